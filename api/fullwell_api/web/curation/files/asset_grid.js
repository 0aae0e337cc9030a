// Cards of assets. Holds what it shows itself, so that a selected card or fifty more cards cost a small message; and only rows in
// or near the window are in the document, so that ten thousand assets scroll as sixty do.
const SPARE_ROWS = 3;
const ASK_ROWS = 8;
const GUESSED_ROW_PX = 260;

export default {
  template: `
    <div>
      <ul ref="grid" class="fw-grid" :class="{waiting: waiting}" aria-label="Assets" :aria-busy="waiting" :data-count="count"
          :style="{paddingTop: above + 'px', paddingBottom: below + 'px'}">
        <li v-for="item in window" :key="item.id" class="fw-card" :data-id="item.id" :aria-setsize="more ? -1 : count"
            :aria-posinset="item.place + 1" :class="{selected: selection.has(item.id), focused: item.id === focus}">
          <button type="button" class="fw-card-open" :aria-label="item.title + ', ' + item.kind + ', ' + item.state"
                  @click="pick(item.id, $event)">
            <img v-if="item.picture && !broken.has(item.picture)" :src="item.picture" :alt="'Preview of ' + item.title"
                 decoding="async" draggable="false" @error="miss(item.picture)">
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
        <template v-if="waiting && !count">
          <li v-for="number in 12" :key="'empty' + number" class="fw-card fw-skeleton" aria-hidden="true">
            <span class="fw-card-open"></span><span class="fw-card-text"></span></li>
        </template>
      </ul>
      <div class="fw-grid-end" aria-live="polite">
        <span v-if="more">Loading more…</span>
        <span v-else-if="count > 24">That is all {{ count.toLocaleString('en') }}.</span>
      </div>
    </div>`,
  emits: ["open", "toggle", "more"],
  data() {
    return {
      count: 0, window: [], above: 0, below: 0, selection: new Set(), focus: "", more: false, waiting: true, broken: new Set(),
    };
  },
  created() {
    // All cards, outside of `data`: nothing watches ten thousand of them.
    this.cards = [];
    this.asked = false;
    this.row = GUESSED_ROW_PX;
    this.columns = 4;
  },
  mounted() {
    this.onScroll = () => this.later();
    window.addEventListener("scroll", this.onScroll, { passive: true });
    this.sizes = new ResizeObserver(() => this.later());
    this.sizes.observe(this.$refs.grid);
  },
  unmounted() {
    window.removeEventListener("scroll", this.onScroll);
    this.sizes.disconnect();
    cancelAnimationFrame(this.queued);
  },
  methods: {
    miss(picture) {
      this.broken = new Set(this.broken).add(picture);
    },
    pick(id, event) {
      if (event.shiftKey || event.ctrlKey || event.metaKey) this.$emit("toggle", { id, range: event.shiftKey });
      else this.$emit("open", id);
    },
    // -- what the server says
    wait() {
      this.waiting = true;
    },
    show(items, more) {
      Object.assign(this, { cards: items.map(Object.freeze), more, waiting: false, broken: new Set() });
      this.changed();
    },
    append(items, more) {
      const known = new Set(this.cards.map((card) => card.id));
      this.cards = this.cards.concat(items.filter((item) => !known.has(item.id)).map(Object.freeze));
      this.more = more;
      this.changed();
    },
    remove(ids) {
      const gone = new Set(ids);
      this.cards = this.cards.filter((card) => !gone.has(card.id));
      this.changed();
    },
    change(items) {
      const changed = new Map(items.map((item) => [item.id, Object.freeze(item)]));
      this.cards = this.cards.map((card) => changed.get(card.id) ?? card);
      this.broken = new Set();
      this.changed();
    },
    async mark(selected, focus, reveal) {
      this.selection = new Set(selected);
      this.focus = focus;
      if (!reveal) return;
      const place = this.cards.findIndex((card) => card.id === focus);
      if (place < 0 || !this.measure()) return;
      this.bringIntoSight(Math.floor(place / this.columns));
      this.lay();
      await this.$nextTick();
      this.$el.querySelector(".fw-card.focused .fw-card-open")?.focus({ preventScroll: true });
    },
    // -- which rows are in the document
    changed() {
      this.asked = false;
      this.count = this.cards.length;
      this.lay();
      // The first cards tell how high a row is.
      this.$nextTick(() => this.lay());
    },
    later() {
      this.queued ??= requestAnimationFrame(() => {
        this.queued = undefined;
        this.lay();
      });
    },
    // False while the grid is hidden behind an open asset.
    measure() {
      const grid = this.$refs.grid;
      if (!grid || !grid.clientWidth) return false;
      const style = getComputedStyle(grid);
      this.columns = Math.max(1, style.gridTemplateColumns.split(" ").length);
      const card = grid.querySelector(".fw-card:not(.fw-skeleton)");
      if (card) this.row = card.getBoundingClientRect().height + parseFloat(style.rowGap);
      this.top = grid.getBoundingClientRect().top + window.scrollY;
      return true;
    },
    lay() {
      if (!this.measure()) return;
      const rows = Math.ceil(this.cards.length / this.columns);
      const above = window.scrollY - this.top;
      const first = Math.min(Math.max(0, Math.floor(above / this.row) - SPARE_ROWS), Math.max(0, rows - 1));
      const last = Math.min(rows, Math.max(first + 1, Math.ceil((above + window.innerHeight) / this.row) + SPARE_ROWS));
      this.window = this.cards
        .slice(first * this.columns, last * this.columns)
        .map((card, place) => ({ ...card, place: first * this.columns + place }));
      this.above = first * this.row;
      this.below = Math.max(0, rows - last) * this.row;
      if (this.more && !this.asked && !this.waiting && last + ASK_ROWS >= rows) {
        this.asked = true;
        this.$emit("more");
      }
    },
    bringIntoSight(row) {
      const head = document.querySelector(".fw-header")?.getBoundingClientRect().bottom ?? 0;
      const start = this.top + row * this.row;
      const low = start - Math.max(0, head) - 12;
      const high = start + this.row - window.innerHeight + 12;
      if (window.scrollY > low) window.scrollTo({ top: low });
      else if (window.scrollY < high) window.scrollTo({ top: high });
    },
  },
};
