// The search field. Keeps its own text: an answer of the server must never change what is being typed.
const PAUSE_MS = 220;

export default {
  template: `
    <div class="fw-search" role="search">
      <q-icon name="o_search" aria-hidden="true"></q-icon>
      <input ref="field" type="search" v-model="text" placeholder="Search title, class, tag, licence" autocomplete="off" spellcheck="false"
             aria-label="Search assets" aria-keyshortcuts="/" @input="typed" @keydown.enter="now" @keydown.esc="escape">
      <kbd aria-hidden="true">/</kbd>
    </div>`,
  props: { start: String },
  emits: ["search"],
  data() {
    return { text: this.start ?? "" };
  },
  unmounted() {
    clearTimeout(this.timer);
  },
  methods: {
    typed() {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.now(), PAUSE_MS);
    },
    now() {
      clearTimeout(this.timer);
      this.$emit("search", this.text);
    },
    escape() {
      if (!this.text) return;
      this.text = "";
      this.now();
    },
    set(text) {
      clearTimeout(this.timer);
      this.text = text;
    },
  },
};
