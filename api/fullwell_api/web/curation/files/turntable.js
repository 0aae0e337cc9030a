// Pictures of one model from all sides. Drag, or the arrow keys, turn it.
export default {
  template: `
    <div class="fw-turn" tabindex="0" role="slider" :aria-label="label + ', turn with the arrow keys'" aria-valuemin="1"
         :aria-valuemax="pictures.length" :aria-valuenow="view + 1" data-arrows
         @pointerdown="grab" @pointermove="drag" @pointerup="drop" @pointercancel="drop" @keydown="key">
      <template v-if="pictures.length">
        <img v-for="(picture, place) in pictures" :key="picture" v-show="place === view" :src="picture" draggable="false"
             :alt="place === view ? label + ', view ' + (place + 1) + ' of ' + pictures.length : ''">
        <span class="fw-turn-dots" aria-hidden="true">
          <i v-for="(picture, place) in pictures" :key="place" :class="{on: place === view}"></i></span>
      </template>
      <span v-else class="fw-nopreview"><q-icon name="o_hourglass_empty" size="34px" aria-hidden="true"></q-icon>
        <span>{{ waiting }}</span></span>
    </div>`,
  props: { pictures: Array, label: String, waiting: String, start: Number },
  emits: ["turned"],
  data() {
    return { view: this.start ?? 0 };
  },
  watch: {
    pictures() {
      if (this.view >= this.pictures.length) this.view = 0;
    },
  },
  methods: {
    turn(steps) {
      const count = this.pictures.length;
      if (!count || !steps) return;
      this.view = (((this.view + steps) % count) + count) % count;
      this.$emit("turned", this.view);
    },
    set(view) {
      if (view < this.pictures.length) this.view = view;
    },
    key(event) {
      const steps = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!steps) return;
      event.preventDefault();
      event.stopPropagation();
      this.turn(steps);
    },
    grab(event) {
      this.from = event.clientX;
      this.$el.setPointerCapture?.(event.pointerId);
    },
    drag(event) {
      if (this.from === undefined || !this.pictures.length) return;
      const step = Math.max(24, this.$el.clientWidth / (1.5 * this.pictures.length));
      const steps = Math.trunc((event.clientX - this.from) / step);
      if (!steps) return;
      this.from += steps * step;
      this.turn(-steps);
    },
    drop() {
      this.from = undefined;
    },
  },
};
