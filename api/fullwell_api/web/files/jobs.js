"use strict";
// The jobs page. All text from the service goes through textContent; nothing is ever parsed as HTML.

const POLL_MS = 2000;
const PAGE = 25;
const THUMBNAILS = 12;
const cards = new Map();   // job id -> {element, fingerprint}
const pictures = new Map(); // address -> object URL
let shownPages = 1;

const byId = (id) => document.getElementById(id);

function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

function headers() {
  const key = sessionStorage.getItem("fullwell-key");
  return key ? { Authorization: `Bearer ${key}` } : {};
}

async function ask(path, options = {}) {
  const answer = await fetch(path, { ...options, headers: headers() });
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({ detail: `the service answered ${answer.status}` }));
  const error = new Error(problem.detail);
  error.status = answer.status;
  throw error;
}

const getJson = async (path) => (await ask(path)).json();

function timeText(job) {
  const when = new Date(job.created_at).toLocaleString();
  if (!job.started_at) return when;
  const end = job.finished_at ? new Date(job.finished_at) : new Date();
  const seconds = Math.max(0, (end - new Date(job.started_at)) / 1000);
  const minutes = Math.floor(seconds / 60);
  return `${when} · ${minutes ? `${minutes} min ` : ""}${Math.round(seconds % 60)} s`;
}

function bar(counts) {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 1000 1");
  svg.setAttribute("preserveAspectRatio", "none");
  let start = 0;
  for (const state of ["done", "failed", "cancelled", "running"]) {
    const width = (1000 * counts[state]) / Math.max(1, counts.total);
    const part = document.createElementNS(space, "rect");
    part.setAttribute("x", start);
    part.setAttribute("width", width);
    part.setAttribute("height", 1);
    part.setAttribute("class", `fill-${state}`);
    svg.append(part);
    start += width;
  }
  const box = make("div", "bar");
  box.setAttribute("role", "progressbar");
  box.setAttribute("aria-valuemin", 0);
  box.setAttribute("aria-valuemax", counts.total);
  box.setAttribute("aria-valuenow", counts.done);
  box.append(svg);
  return box;
}

function countText(counts) {
  const parts = ["running", "queued", "failed", "cancelled"].filter((s) => counts[s]).map((s) => `${counts[s]} ${s}`);
  return [`${counts.done} of ${counts.total} frames done`, ...parts].join(" · ");
}

function actionButton(label, path) {
  const button = make("button", "", label);
  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      await ask(path, { method: "POST" });
      await refresh();
    } catch (error) {
      showTrouble(error.message);
    } finally {
      button.disabled = false;
    }
  });
  return button;
}

async function pictureAddress(url) {
  if (!pictures.has(url)) pictures.set(url, URL.createObjectURL(await (await ask(url)).blob()));
  return pictures.get(url);
}

async function thumbnail(job, number) {
  const products = (await getJson(`/v1/jobs/${job.id}/frames/${number}/products`)).items;
  const picture = products.find((product) => product.name.split("/").pop() === "image.png");
  if (!picture) return null;
  const source = await pictureAddress(picture.url.split("/").map(encodeURIComponent).join("/"));
  const button = make("button", "thumb");
  const image = make("img");
  image.src = source;
  image.alt = `Frame ${number} of ${job.name}`;
  button.append(image);
  button.addEventListener("click", () => {
    const viewer = byId("viewer");
    viewer.querySelector("img").src = source;
    viewer.querySelector("img").alt = image.alt;
    viewer.querySelector("p").textContent = `${job.name}, frame ${number}, ${picture.name}`;
    viewer.showModal();
  });
  return button;
}

async function fillDetails(job, card) {
  const detail = card.querySelector(".thumbs");
  if (job.frames.done && detail.childElementCount < THUMBNAILS) {
    const done = (await getJson(`/v1/jobs/${job.id}/frames?state=done&limit=${THUMBNAILS}`)).items;
    for (const frame of done) {
      if (detail.querySelector(`[data-frame="${frame.number}"]`)) continue;
      const picture = await thumbnail(job, frame.number).catch(() => null);
      if (!picture) continue;
      picture.dataset.frame = frame.number;
      const later = [...detail.children].find((other) => Number(other.dataset.frame) > frame.number);
      detail.insertBefore(picture, later || null);
    }
  }
  const errors = card.querySelector(".errors");
  const failed = job.frames.failed ? (await getJson(`/v1/jobs/${job.id}/frames?state=failed&limit=5`)).items : [];
  errors.replaceChildren(...failed.map((f) => make("li", "", `Frame ${f.number}: ${f.error ? f.error.message : "failed"}`)));
  if (job.frames.failed > failed.length) errors.append(make("li", "", `and ${job.frames.failed - failed.length} more`));
}

function draw(job) {
  let known = cards.get(job.id);
  if (!known) {
    const element = make("section", "job");
    element.append(make("div", "top"), make("div", "middle"), make("ul", "errors"), make("div", "thumbs"));
    known = { element, fingerprint: "" };
    cards.set(job.id, known);
  }
  const active = job.state === "queued" || job.state === "running";
  const top = known.element.querySelector(".top");
  const state = job.cancel_requested && active ? "cancelling" : job.state;
  const actions = make("div", "actions");
  if (active && !job.cancel_requested) actions.append(actionButton("Cancel", `/v1/jobs/${job.id}/cancel`));
  if (job.frames.failed && !job.cancel_requested) actions.append(actionButton("Retry failed", `/v1/jobs/${job.id}/retry`));
  const fingerprint = JSON.stringify(job);
  if (fingerprint !== known.fingerprint) {
    top.replaceChildren(
      make("h2", "", job.name), make("span", `state ${job.state}`, state), make("span", "id", job.id),
      make("span", "times", timeText(job)), actions);
    known.element.querySelector(".middle").replaceChildren(bar(job.frames), make("p", "counts", countText(job.frames)));
    known.fingerprint = fingerprint;
    fillDetails(job, known.element).catch((error) => showTrouble(error.message));
  } else if (active) {
    top.querySelector(".times").textContent = timeText(job);
  }
  return known.element;
}

function showTrouble(text) {
  byId("trouble").hidden = !text;
  byId("trouble").textContent = text || "";
}

async function refresh() {
  try {
    let cursor = null;
    const jobs = [];
    for (let page = 0; page < shownPages; page += 1) {
      const answer = await getJson(`/v1/jobs?limit=${PAGE}${cursor ? `&cursor=${encodeURIComponent(cursor)}` : ""}`);
      jobs.push(...answer.items);
      cursor = answer.next_cursor;
      if (!cursor) break;
    }
    const list = byId("jobs");
    const elements = jobs.map(draw);
    elements.forEach((element, place) => {
      if (list.children[place] !== element) list.insertBefore(element, list.children[place] || null);
    });
    byId("empty").hidden = jobs.length > 0;
    byId("more").hidden = !cursor;
    byId("key-form").hidden = true;
    const active = jobs.filter((job) => job.state === "running" || job.state === "queued").length;
    byId("summary").textContent = active ? `${active} active job${active > 1 ? "s" : ""}` : "idle";
    showTrouble("");
  } catch (error) {
    if (error.status === 401) {
      byId("key-form").hidden = false;
      byId("key-answer").textContent = sessionStorage.getItem("fullwell-key") ? "That key is not valid." : "";
    } else {
      showTrouble(error.status ? error.message : "The service cannot be reached; trying again.");
    }
  }
}

byId("more").addEventListener("click", () => { shownPages += 1; refresh(); });
byId("key-form").addEventListener("submit", (event) => {
  event.preventDefault();
  sessionStorage.setItem("fullwell-key", byId("key").value.trim());
  refresh();
});

(async function loop() {
  if (!document.hidden) await refresh();
  setTimeout(loop, POLL_MS);
})();
