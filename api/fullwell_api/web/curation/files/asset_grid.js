// Cards of assets. Holds what it shows itself, so that a selected card or fifty more cards cost a small message.
export default {
  template: `
    <div>
      <ul class="fw-grid" :class="{waiting: waiting}" aria-label="Assets" :aria-busy="waiting">
        <li v-for="item in items" :key="item.id" class="fw-card" :data-id="item.id"
            :class="{selected: selection.has(item.id), focused: item.id === focus}">
          <button type="button" class="fw-card-open" :ref="(element) => keep(item.id, element)"
                  :aria-label="item.title + ', ' + item.kind + ', ' + item.state" @click="pick(item.id, $event)">
            <img v-if="item.picture && !broken.has(item.picture)" :src="item.picture" :alt="'Preview of ' + item.title"
                 loading="lazy" decoding="async" draggable="false" @error="miss(item.picture)">
            <span v-else class="fw-nopreview"><q-icon name="o_view_in_ar" size="34px" aria-hidden="true"></q-icon>
              <span>no preview yet</span></span>
          </button>
          <label class="fw-card-check" :title="'Select ' + item.title + ' (x)'">
            <input type="checkbox" :checked="selection.has(item.id)" :aria-label="'Select ' + item.title"
                   @click.prevent="$emit('toggle', {id: item.id, range: $event.shiftKey})">
          </label>
          <span v-if="item.decide" class="fw-card-decide" title="A check asks for a decision">
            <q-icon name="o_priority_high" size="14px" aria-hidden="true"></q-icon>decide</span>
          <div class="fw-card-text">
            <span class="fw-card-title" :title="item.title">{{ item.title }}</span>
            <span class="fw-card-line"><span>{{ item.kind }}</span><span class="fw-num">{{ item.size }}</span></span>
            <span class="fw-card-line"><span class="fw-state" :class="item.state">{{ item.state }}</span>
              <span class="fw-card-licence" :title="item.licence">{{ item.licence }}</span></span>
          </div>
        </li>
        <template v-if="waiting && !items.length">
          <li v-for="number in 12" :key="'empty' + number" class="fw-card fw-skeleton" aria-hidden="true">
            <span class="fw-card-open"></span><span class="fw-card-text"></span></li>
        </template>
      </ul>
      <div ref="end" class="fw-grid-end" aria-live="polite">
        <span v-if="more">Loading more…</span>
        <span v-else-if="items.length > 24">That is all {{ items.length.toLocaleString('en') }}.</span>
      </div>
    </div>`,
  emits: ["open", "toggle", "more"],
  data() {
    return { items: [], selection: new Set(), focus: "", more: false, waiting: true, broken: new Set() };
  },
  created() {
    this.buttons = new Map();
    this.asked = false;
  },
  mounted() {
    this.watcher = new IntersectionObserver((seen) => seen.some((entry) => entry.isIntersecting) && this.ask(), {
      rootMargin: "1200px",
    });
    this.watcher.observe(this.$refs.end);
  },
  unmounted() {
    this.watcher.disconnect();
  },
  methods: {
    keep(id, element) {
      if (element) this.buttons.set(id, element);
      else this.buttons.delete(id);
    },
    miss(picture) {
      this.broken = new Set(this.broken).add(picture);
    },
    pick(id, event) {
      if (event.shiftKey || event.ctrlKey || event.metaKey) this.$emit("toggle", { id, range: event.shiftKey });
      else this.$emit("open", id);
    },
    ask() {
      if (!this.more || this.asked || this.waiting) return;
      this.asked = true;
      this.$emit("more");
    },
    wait() {
      this.waiting = true;
    },
    show(items, more) {
      Object.assign(this, { items, more, waiting: false, broken: new Set() });
      this.again();
    },
    append(items, more) {
      const known = new Set(this.items.map((item) => item.id));
      this.items.push(...items.filter((item) => !known.has(item.id)));
      this.more = more;
      this.again();
    },
    remove(ids) {
      const gone = new Set(ids);
      this.items = this.items.filter((item) => !gone.has(item.id));
      this.again();
    },
    change(items) {
      const changed = new Map(items.map((item) => [item.id, item]));
      this.items = this.items.map((item) => changed.get(item.id) ?? item);
      this.broken = new Set();
    },
    mark(selected, focus, reveal) {
      this.selection = new Set(selected);
      this.focus = focus;
      if (!reveal) return;
      this.$nextTick(() => {
        const button = this.buttons.get(focus);
        button?.focus({ preventScroll: true });
        button?.closest(".fw-card").scrollIntoView({ block: "nearest" });
      });
    },
    // The observer tells of changes only; after a short page the end may still be in sight.
    again() {
      this.asked = false;
      this.$nextTick(() => {
        this.watcher?.unobserve(this.$refs.end);
        this.watcher?.observe(this.$refs.end);
      });
    },
  },
};
