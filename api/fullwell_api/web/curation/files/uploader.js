// Files dropped anywhere on the page, or chosen: sent one after the other, then followed until their previews are there.
const MODELS = [".glb", ".gltf", ".obj", ".ply", ".stl", ".usd", ".usda", ".usdc", ".usdz", ".zip"];
const IGNORED = [".ds_store", "thumbs.db", "desktop.ini"];

const suffix = (name) => name.slice(name.lastIndexOf(".")).toLowerCase();
const isModel = (path) => MODELS.includes(suffix(path));

function entriesOf(reader) {
  return new Promise((resolve, reject) => reader.readEntries(resolve, reject));
}

// All files of a dropped file or folder, with their paths: a model may name textures in folders beside it.
async function filesOf(entry, found) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    found.push({ path: entry.fullPath.replace(/^\//, ""), file });
    return;
  }
  const reader = entry.createReader();
  for (let some = await entriesOf(reader); some.length; some = await entriesOf(reader)) {
    for (const child of some) await filesOf(child, found);
  }
}

export default {
  template: `
    <div>
      <input ref="chooser" type="file" multiple class="fw-hidden" aria-label="Models to upload" @change="chosen">
      <div v-if="over" class="fw-drop" :class="{no: !allowed}" aria-hidden="true">
        <div><q-icon :name="allowed ? 'o_upload_file' : 'o_lock'" size="46px"></q-icon>
          <strong>{{ allowed ? 'Drop models to import them' : 'Sign in with a curator key to import' }}</strong>
          <span v-if="allowed">GLB, glTF, OBJ, PLY, STL, USD or a ZIP with one of them; folders with textures too</span></div>
      </div>
      <section v-if="rows.length" class="fw-tray" aria-label="Uploads">
        <header><strong>{{ title }}</strong>
          <button type="button" class="fw-icon" :aria-label="folded ? 'Show uploads' : 'Fold uploads'" @click="folded = !folded">
            <q-icon :name="folded ? 'o_expand_less' : 'o_expand_more'" size="20px" aria-hidden="true"></q-icon></button>
          <button type="button" class="fw-icon" aria-label="Remove finished uploads from this list" :disabled="busy" @click="rows = []">
            <q-icon name="o_close" size="20px" aria-hidden="true"></q-icon></button></header>
        <ul v-show="!folded" aria-live="polite">
          <li v-for="row in rows" :key="row.key" :class="row.state" :data-upload="row.name">
            <img v-if="row.picture" :src="row.picture" alt="" class="fw-tray-picture">
            <span v-else class="fw-tray-picture"><q-icon :name="row.state === 'failed' ? 'o_error_outline' : 'o_view_in_ar'" size="22px"
              aria-hidden="true"></q-icon></span>
            <div class="fw-tray-text">
              <span class="fw-tray-name" :title="row.name">{{ row.name }}</span>
              <span class="fw-tray-note">{{ row.note }}</span>
              <progress v-if="row.state !== 'failed' && row.state !== 'done'" :value="row.fraction" max="1" :aria-label="'Progress of ' + row.name"></progress>
              <ul v-if="row.checks?.length" class="fw-tray-checks">
                <li v-for="check in row.checks" :key="check.text" :class="check.state">{{ check.text }}</li></ul>
            </div>
            <button v-if="row.asset" type="button" class="fw-button small" @click="$emit('open', row.asset)">Open</button>
            <button v-else-if="row.retry" type="button" class="fw-button small" @click="$emit('retry', row.key)">Retry</button>
          </li>
        </ul>
      </section>
    </div>`,
  props: { allowed: Boolean, address: String, most: Number },
  emits: ["chosen", "sent", "open", "retry", "refused"],
  data() {
    return { over: false, rows: [], folded: false };
  },
  computed: {
    busy() {
      return this.rows.some((row) => !["done", "failed"].includes(row.state));
    },
    title() {
      const open = this.rows.filter((row) => !["done", "failed"].includes(row.state)).length;
      const failed = this.rows.filter((row) => row.state === "failed").length;
      if (open) return `Importing ${open} of ${this.rows.length}`;
      return failed ? `${this.rows.length - failed} imported, ${failed} refused` : `${this.rows.length} imported`;
    },
  },
  created() {
    this.waiting = [];
    this.depth = 0;
    this.number = 0;
  },
  mounted() {
    this.listeners = {
      dragenter: (event) => this.hover(event, 1),
      dragleave: (event) => this.hover(event, -1),
      dragover: (event) => this.carriesFiles(event) && event.preventDefault(),
      drop: (event) => this.dropped(event),
      beforeunload: (event) => this.rows.some((row) => row.state === "sending") && event.preventDefault(),
    };
    for (const [name, listener] of Object.entries(this.listeners)) window.addEventListener(name, listener);
  },
  unmounted() {
    for (const [name, listener] of Object.entries(this.listeners)) window.removeEventListener(name, listener);
  },
  methods: {
    carriesFiles(event) {
      return [...(event.dataTransfer?.types ?? [])].includes("Files");
    },
    hover(event, change) {
      if (!this.carriesFiles(event)) return;
      event.preventDefault();
      this.depth = Math.max(0, this.depth + change);
      this.over = this.depth > 0;
    },
    async dropped(event) {
      if (!this.carriesFiles(event)) return;
      event.preventDefault();
      this.depth = 0;
      this.over = false;
      if (!this.allowed) return;
      // The entries are there during the event only, so all are taken before the first wait.
      const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.() ?? item.getAsFile()).filter(Boolean);
      const found = [];
      try {
        for (const entry of entries) {
          if (entry instanceof File) found.push({ path: entry.name, file: entry });
          else await filesOf(entry, found);
        }
      } catch (error) {
        this.$emit("refused", `The dropped files cannot be read: ${error.message}.`);
        return;
      }
      this.take(found);
    },
    choose() {
      this.$refs.chooser.value = "";
      this.$refs.chooser.click();
    },
    chosen(event) {
      this.take([...event.target.files].map((file) => ({ path: file.webkitRelativePath || file.name, file })));
    },
    take(found) {
      const files = found.filter(({ path }) => !IGNORED.some((name) => path.toLowerCase().endsWith(name)) && !path.startsWith("__MACOSX"));
      const models = files.filter(({ path }) => isModel(path));
      const large = files.find(({ file }) => file.size > this.most);
      if (!models.length) this.$emit("refused", `None of these ${files.length} files is a model. Models end in ${MODELS.join(", ")}.`);
      else if (large) this.$emit("refused", `${large.path} is larger than this service takes (${Math.floor(this.most / 2 ** 20)} MiB).`);
      else {
        this.waiting = files;
        this.$emit("chosen", models.map(({ path, file }) => ({ name: path, bytes: file.size })));
      }
    },
    async start(note) {
      const files = this.waiting;
      this.waiting = [];
      this.folded = window.innerWidth < 600;
      const models = files.filter(({ path }) => isModel(path));
      const beside = files.filter(({ path }) => !isModel(path));
      const rows = models.map((model) => ({
        key: `u${(this.number += 1)}`, name: model.path, state: "sending", note: "waiting", fraction: 0, model,
      }));
      this.rows.push(...rows.map(({ model, ...row }) => row));
      const digests = {};
      for (const { key, model } of rows) {
        try {
          const mine = [...beside.filter(({ path }) => !(path in digests)), model];
          const total = mine.reduce((sum, { file }) => sum + file.size, 0) || 1;
          let before = 0;
          for (const { path, file } of mine) {
            digests[path] = await this.send(path, file, (sent) => {
              const fraction = (before + sent) / total;
              this.update(key, { note: `sending, ${Math.round(100 * fraction)} %`, fraction });
            });
            before += file.size;
          }
          this.update(key, { state: "queued", note: "sent", fraction: 0 });
          const needed = [...beside.map(({ path }) => path), model.path];
          const named = Object.fromEntries(needed.map((path) => [path, digests[path]]));
          this.$emit("sent", { key, main: model.path, files: named, batch: note });
        } catch (error) {
          this.update(key, { state: "failed", note: error.message });
        }
      }
    },
    send(path, file, progress) {
      return new Promise((resolve, reject) => {
        const request = new XMLHttpRequest();
        request.open("POST", this.address);
        request.setRequestHeader("Content-Type", "application/octet-stream");
        request.responseType = "json";
        request.upload.onprogress = (event) => progress(event.loaded);
        request.onload = () => {
          if (request.status < 300) resolve(request.response.sha256);
          else reject(new Error(request.response?.detail ?? `The service answered ${request.status}.`));
        };
        request.onerror = () => reject(new Error(`${path} could not be sent: the service cannot be reached, or the file has changed.`));
        request.send(file);
      });
    },
    update(key, changes) {
      this.rows = this.rows.map((row) => (row.key === key ? { ...row, ...changes } : row));
    },
    follow(changes) {
      for (const { key, ...rest } of changes) this.update(key, rest);
    },
    // Work that was going on before the page was opened.
    adopt(rows) {
      this.folded ||= window.innerWidth < 600;
      const known = new Set(this.rows.map((row) => row.key));
      this.rows.push(...rows.filter((row) => !known.has(row.key)));
    },
  },
};
