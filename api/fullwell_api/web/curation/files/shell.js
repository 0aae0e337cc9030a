// What belongs to the whole page: keyboard shortcuts, the address bar, the theme. Draws nothing.
const THEMES = ["auto", "light", "dark"];
const STORED = "fullwell-theme";

export default {
  template: "<span hidden></span>",
  emits: ["key", "address", "theme", "undo"],
  mounted() {
    this.onKey = (event) => this.key(event);
    this.onPop = () => this.$emit("address", window.location.search);
    document.addEventListener("keydown", this.onKey);
    window.addEventListener("popstate", this.onPop);
    let theme = "auto";
    try {
      theme = localStorage.getItem(STORED) ?? "auto";
    } catch {
      // Storage may be forbidden; the system's choice is a good one.
    }
    this.applyTheme(THEMES.includes(theme) ? theme : "auto");
  },
  unmounted() {
    document.removeEventListener("keydown", this.onKey);
    window.removeEventListener("popstate", this.onPop);
  },
  methods: {
    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || event.isComposing) return;
      const target = event.target;
      const typing = target.closest?.("input:not([type=checkbox]), textarea, select, [contenteditable=true]");
      if (typing) {
        if (event.key === "Escape") target.blur();
        return;
      }
      // Dialogs and menus have keys of their own.
      if (document.querySelector(".q-dialog, .q-menu")) return;
      if (event.key === "/") {
        event.preventDefault();
        document.querySelector(".fw-search input")?.focus();
        return;
      }
      const onButton = target.closest?.("button, a, input, summary, [role=slider], [role=button]");
      if ((event.key === "Enter" || event.key === " ") && onButton) return;
      if (event.key.startsWith("Arrow") && (onButton?.getAttribute("role") === "slider" || target.closest?.("[data-arrows]"))) return;
      const known = ["a", "r", "j", "k", "x", "e", "c", "?", "Escape", "Enter", "ArrowLeft", "ArrowRight"];
      if (!known.includes(event.key)) return;
      event.preventDefault();
      this.$emit("key", event.key);
    },
    push(address) {
      if (address !== window.location.pathname + window.location.search) history.pushState({}, "", address);
    },
    replace(address) {
      history.replaceState({}, "", address);
    },
    cycleTheme() {
      const next = THEMES[(THEMES.indexOf(this.theme) + 1) % THEMES.length];
      try {
        localStorage.setItem(STORED, next);
      } catch {
        // As above: then the choice lasts as long as the page.
      }
      this.applyTheme(next);
    },
    applyTheme(theme) {
      this.theme = theme;
      Quasar.Dark.set(theme === "auto" ? "auto" : theme === "dark");
      this.$emit("theme", theme);
    },
    // A notice with a way back.
    tellUndoable(message, type, milliseconds) {
      const actions = [{ label: "Undo", noCaps: true, handler: () => this.$emit("undo") }];
      Quasar.Notify.create({ message, type, timeout: milliseconds, actions });
    },
    async signIn(key) {
      const answer = await fetch("session", {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ key }),
      });
      if (answer.ok) {
        window.location.reload();
        return "";
      }
      const problem = await answer.json().catch(() => ({}));
      return problem.detail ?? `The service answered ${answer.status}.`;
    },
    async signOut() {
      await fetch("session", { method: "DELETE" });
      window.location.reload();
    },
    // An asset opens in place of the grid; the grid is found again where it was left.
    enter() {
      if (this.left === undefined) this.left = window.scrollY;
      window.scrollTo({ top: 0 });
    },
    opened(title) {
      if (document.title !== `${title} · Fullwell`) document.querySelector(".fw-detail-name h1")?.focus({ preventScroll: true });
      document.title = `${title} · Fullwell`;
    },
    leave() {
      document.title = "Assets · Fullwell";
      const top = this.left;
      this.left = undefined;
      if (top !== undefined) requestAnimationFrame(() => requestAnimationFrame(() => window.scrollTo({ top })));
    },
  },
};
