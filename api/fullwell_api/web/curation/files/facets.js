// The filter panel: what can be chosen, how many there are of each, and the ranges of size.
const SPANS = [
  ["length", "Length"],
  ["width", "Width"],
  ["height", "Height"],
];

export default {
  template: `
    <div class="fw-facets">
      <section v-for="group in groups" :key="group.key">
        <h2>{{ group.title }}</h2>
        <input v-if="group.options.length > 14" type="search" class="fw-mini" v-model="needle[group.key]"
               :placeholder="'Find in ' + group.options.length" :aria-label="'Find in ' + group.title">
        <ul>
          <li v-for="option in shown(group)" :key="option.name">
            <label :class="{on: option.on, none: !option.count}">
              <input type="checkbox" :checked="option.on" @change="$emit('choose', {key: group.key, name: option.name})">
              <span class="fw-facet-name">{{ option.label }}</span><span class="fw-num fw-soft">{{ option.count.toLocaleString('en') }}</span>
            </label>
          </li>
        </ul>
        <button v-if="hidden(group) > 0" type="button" class="fw-link" @click="open[group.key] = true">
          {{ hidden(group) }} more</button>
        <p v-if="!group.options.length" class="fw-soft fw-small">none</p>
      </section>
      <section>
        <h2>Size in metres</h2>
        <div v-for="[key, title] in spans" :key="key" class="fw-span">
          <span>{{ title }}</span>
          <input type="number" min="0" step="any" inputmode="decimal" placeholder="min" :aria-label="title + ' at least, m'"
                 :value="sizes[key]?.[0]" @change="span(key, 0, $event)">
          <span aria-hidden="true">–</span>
          <input type="number" min="0" step="any" inputmode="decimal" placeholder="max" :aria-label="title + ' at most, m'"
                 :value="sizes[key]?.[1]" @change="span(key, 1, $event)">
        </div>
      </section>
    </div>`,
  emits: ["choose", "span"],
  data() {
    return { groups: [], sizes: {}, spans: SPANS, needle: {}, open: {} };
  },
  methods: {
    show(groups, sizes) {
      this.groups = groups;
      this.sizes = sizes;
    },
    matching(group) {
      const needle = (this.needle[group.key] ?? "").toLowerCase();
      return group.options.filter((option) => option.on || option.label.toLowerCase().includes(needle));
    },
    shown(group) {
      const all = this.matching(group);
      return this.open[group.key] ? all : all.filter((option, place) => place < 10 || option.on);
    },
    hidden(group) {
      return this.matching(group).length - this.shown(group).length;
    },
    span(key, end, event) {
      const both = [...(this.sizes[key] ?? [null, null])];
      both[end] = event.target.value === "" ? null : Number(event.target.value);
      this.sizes = { ...this.sizes, [key]: both };
      this.$emit("span", { key, low: both[0], high: both[1] });
    },
  },
};
