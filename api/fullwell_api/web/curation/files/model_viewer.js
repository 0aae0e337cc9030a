// A model to turn: ground grid in metres, a person of 1.75 m beside it, its extents drawn. Draws when something changes only.
import { CSS2DObject, CSS2DRenderer, GLTFLoader, OrbitControls, THREE } from "nicegui-scene";

const PERSON_M = 1.75;
// Half the outline of a standing person, from between the legs to the neck [m from the middle, m above the ground].
const HALF_PERSON = [
  [0.012, 0.82], [0.03, 0.45], [0.035, 0.08], [0.03, 0.0], [0.14, 0.0], [0.135, 0.04], [0.095, 0.1], [0.125, 0.38], [0.13, 0.5],
  [0.165, 0.78], [0.172, 0.92], [0.142, 1.08], [0.158, 1.28], [0.185, 1.1], [0.205, 0.86], [0.21, 0.76], [0.24, 0.7], [0.265, 0.78],
  [0.258, 0.92], [0.245, 1.15], [0.228, 1.36], [0.19, 1.43], [0.075, 1.475], [0.05, 1.5], [0.052, 1.56],
];
const HEAD = { middle: 1.632, across: 0.078, along: 0.118 };
const TURN_STEP = Math.PI / 18;

function personShape() {
  const right = HALF_PERSON.map(([x, y]) => new THREE.Vector2(x, y));
  const left = HALF_PERSON.map(([x, y]) => new THREE.Vector2(-x, y)).reverse();
  const body = new THREE.Shape([...right, ...left]);
  const head = new THREE.Shape();
  head.absellipse(0, HEAD.middle, HEAD.across, HEAD.along, 0, 2 * Math.PI);
  return [body, head];
}

function each(object, action) {
  object.traverse((child) => child.isMesh && action(child));
}

function free(object) {
  object.traverse((child) => {
    child.geometry?.dispose();
    for (const material of [child.material ?? []].flat()) {
      for (const value of Object.values(material)) if (value?.isTexture) value.dispose();
      material.dispose();
    }
    child.element?.remove();
  });
}

export default {
  template: `
    <div class="fw-viewer">
      <div ref="stage" class="fw-stage" tabindex="0" role="img" data-arrows :aria-label="label + ', 3D model; turn it with the mouse or the arrow keys'"
           @keydown="key"></div>
      <div v-if="note" class="fw-viewer-note" :class="{bad: failed}" role="status">{{ note }}</div>
      <div class="fw-viewer-tools">
        <button type="button" class="fw-tool" :aria-pressed="scale" title="Person of 1.75 m, grid and extents" @click="toggleScale">
          <q-icon name="o_straighten" size="18px" aria-hidden="true"></q-icon><span>Scale</span></button>
        <button type="button" class="fw-tool" :aria-pressed="wire" title="Triangles" @click="toggleWire">
          <q-icon name="o_grid_3x3" size="18px" aria-hidden="true"></q-icon><span>Triangles</span></button>
        <button type="button" class="fw-tool" title="The first view again" @click="home">
          <q-icon name="o_center_focus_strong" size="18px" aria-hidden="true"></q-icon><span>Reset</span></button>
      </div>
    </div>`,
  props: { source: String, label: String, size: Array, paints: Object, picked: String },
  emits: ["part"],
  data() {
    return { note: "Loading the model…", failed: false, scale: true, wire: false };
  },
  mounted() {
    try {
      this.build();
    } catch {
      this.tell("This browser has no WebGL: use the turntable.", true);
      return;
    }
    this.load();
  },
  beforeUnmount() {
    this.gone = true;
    this.sizes?.disconnect();
    this.themes?.disconnect();
    if (!this.renderer) return;
    this.controls.dispose();
    free(this.scene);
    this.scene.environment?.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  },
  watch: {
    source() {
      this.load();
    },
    picked() {
      this.highlight();
    },
  },
  methods: {
    // What Three.js makes is kept out of `data`: wrapped in proxies it would be slow and wrong.
    build() {
      const stage = this.$refs.stage;
      const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, powerPreference: "low-power" });
      renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      renderer.toneMapping = THREE.ACESFilmicToneMapping;
      renderer.toneMappingExposure = 1.05;
      renderer.shadowMap.enabled = true;
      renderer.shadowMap.type = THREE.PCFSoftShadowMap;
      const names = new CSS2DRenderer();
      names.domElement.className = "fw-stage-names";
      stage.append(renderer.domElement, names.domElement);
      const scene = new THREE.Scene();
      const camera = new THREE.PerspectiveCamera(32, 1, 0.01, 4000);
      const controls = new OrbitControls(camera, stage);
      controls.maxPolarAngle = Math.PI * 0.52;
      controls.addEventListener("change", () => this.draw());
      Object.assign(this, { renderer, names, scene, camera, controls });
      this.light();
      this.sizes = new ResizeObserver(() => this.fit());
      this.sizes.observe(stage);
      this.themes = new MutationObserver(() => this.dress());
      this.themes.observe(document.body, { attributes: true, attributeFilter: ["class"] });
      stage.addEventListener("pointerdown", (event) => (this.pressed = [event.clientX, event.clientY]));
      stage.addEventListener("pointerup", (event) => this.pick(event));
      this.fit();
    },
    light() {
      // A room with a bright ceiling and two windows: what paint and chrome look like depends on what they mirror.
      const room = new THREE.Scene();
      const wall = (color, power, size, place) => {
        const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(color).multiplyScalar(power), side: THREE.DoubleSide });
        const mesh = new THREE.Mesh(new THREE.BoxGeometry(...size), material);
        mesh.position.set(...place);
        room.add(mesh);
      };
      wall("#c3ccd6", 0.75, [40, 40, 40], [0, 12, 0]);
      wall("#ffffff", 5, [22, 0.2, 10], [0, 18, 0]);
      wall("#fff4e2", 3.5, [0.2, 10, 14], [18, 10, -4]);
      wall("#e3efff", 2.5, [12, 8, 0.2], [-6, 9, 18]);
      wall("#8c8f92", 0.5, [39, 0.2, 39], [0, -7, 0]);
      const maker = new THREE.PMREMGenerator(this.renderer);
      this.scene.environment = maker.fromScene(room, 0.03).texture;
      maker.dispose();
      free(room);
      this.sun = new THREE.DirectionalLight("#fffaf0", 1.6);
      this.sun.castShadow = true;
      this.sun.shadow.mapSize.set(1024, 1024);
      this.scene.add(this.sun, this.sun.target);
    },
    async load() {
      if (!this.renderer) return;
      const source = this.source;
      this.tell("Loading the model…");
      try {
        const answer = await fetch(source);
        if (!answer.ok) throw new Error(answer.status === 404 ? "its file is not in the store" : `the service answered ${answer.status}`);
        const model = await new GLTFLoader().parseAsync(await answer.arrayBuffer(), "");
        if (this.gone || source !== this.source) return free(model.scene);
        this.place(model.scene);
        this.tell("");
      } catch (error) {
        if (!this.gone && source === this.source) this.tell(`The model cannot be shown: ${error.message}.`, true);
      }
    },
    tell(note, failed = false) {
      this.note = note;
      this.failed = failed;
    },
    place(model) {
      const first = !this.model;
      if (this.model) {
        this.scene.remove(this.model);
        free(this.model);
      }
      this.model = model;
      each(model, (mesh) => {
        mesh.castShadow = mesh.receiveShadow = true;
        mesh.material = mesh.material.clone();
        mesh.material.wireframe = this.wire;
        const paint = this.namesOf(mesh).find((name) => name in (this.paints ?? {}));
        if (!paint) return;
        mesh.material.map = null;
        mesh.material.color.set(this.paints[paint]);
      });
      this.scene.add(model);
      this.box = new THREE.Box3().setFromObject(model);
      this.surround();
      if (first) this.home();
      this.highlight();
      this.draw();
    },
    // Everything around the model that tells its size.
    surround() {
      if (this.around) {
        this.scene.remove(this.around);
        free(this.around);
      }
      const size = this.box.getSize(new THREE.Vector3());
      const reach = Math.max(size.x, size.z, 2);
      const cell = reach > 60 ? 10 : reach > 16 ? 5 : reach > 1.2 ? 1 : 0.5;
      const cells = 2 * Math.ceil((reach * 0.5 + Math.max(1.6, reach * 0.35)) / cell);
      const group = new THREE.Group();
      const grid = new THREE.GridHelper(cells * cell, cells);
      grid.position.y = -0.002;
      grid.material.transparent = true;
      const ground = new THREE.Mesh(new THREE.PlaneGeometry(cells * cell, cells * cell), new THREE.ShadowMaterial({ opacity: 0.28 }));
      ground.rotation.x = -Math.PI / 2;
      ground.receiveShadow = true;
      group.add(ground);
      this.measures = new THREE.Group();
      this.person = new THREE.Group();
      const ink = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, transparent: true, opacity: 0.6 });
      for (const shape of personShape()) this.person.add(new THREE.Mesh(new THREE.ShapeGeometry(shape, 24), ink));
      const gap = 0.55 + 0.06 * reach;
      this.person.position.set(this.box.min.x - gap * 0.6, 0, this.box.max.z + gap * 0.75);
      this.person.add(this.named(`${PERSON_M.toFixed(2)} m`, [0, PERSON_M + 0.14, 0], "fw-dim soft"));
      this.extents(size);
      this.measures.add(grid, this.person, this.named(`grid ${cell} m`, [(cells * cell) / 2, 0, (cells * cell) / 2], "fw-dim soft"));
      group.add(this.measures);
      Object.assign(this, { around: group, grid, ink });
      this.scene.add(group);
      this.sun.position.set(reach * 0.7, reach * 1.5 + size.y, reach * 0.9);
      const shade = this.sun.shadow.camera;
      const half = Math.max(reach, size.y) * 1.1;
      Object.assign(shade, { left: -half, right: half, top: half, bottom: -half, near: 0.1, far: half * 6 });
      shade.updateProjectionMatrix();
      this.sun.shadow.bias = -0.0006;
      this.sun.shadow.normalBias = 0.004 * half;
      this.dress();
    },
    extents(size) {
      const { min, max } = this.box;
      const off = 0.06 * Math.max(size.x, size.z, 1);
      const lines = [
        [[min.x, 0, max.z + off], [max.x, 0, max.z + off], this.size[0], "length"],
        [[max.x + off, 0, min.z], [max.x + off, 0, max.z], this.size[1], "width"],
        [[max.x + off, min.y, min.z - off], [max.x + off, max.y, min.z - off], this.size[2], "height"],
      ];
      this.rules = new THREE.LineBasicMaterial();
      for (const [from, to, metres, name] of lines) {
        const ends = [new THREE.Vector3(...from), new THREE.Vector3(...to)];
        this.measures.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), this.rules));
        const middle = ends[0].clone().add(ends[1]).multiplyScalar(0.5).toArray();
        const digits = metres >= 10 ? 1 : metres >= 0.1 ? 2 : 3;
        const label = this.named(`${metres.toFixed(digits)} m`, middle, "fw-dim");
        label.element.title = name;
        this.measures.add(label);
      }
    },
    named(text, place, className) {
      const element = document.createElement("span");
      element.className = className;
      element.textContent = text;
      const label = new CSS2DObject(element);
      label.position.set(...place);
      return label;
    },
    // Colours that follow the page's theme.
    dress() {
      if (!this.around) return;
      const styles = getComputedStyle(this.$el);
      const colour = (name) => new THREE.Color(styles.getPropertyValue(name).trim() || "#888888");
      this.grid.material.vertexColors = false;
      this.grid.material.color = colour("--fw-grid-line");
      this.grid.material.opacity = 0.75;
      this.grid.material.needsUpdate = true;
      this.ink.color = colour("--fw-person");
      this.rules.color = colour("--fw-rule");
      this.measures.visible = this.scale;
      this.draw();
    },
    home() {
      if (!this.box) return;
      const size = this.box.getSize(new THREE.Vector3());
      const beside = this.scale ? Math.max(0, PERSON_M - size.y) * 0.2 : 0;
      const middle = this.box.getCenter(new THREE.Vector3());
      middle.y = size.y / 2 + beside;
      const round = 0.5 * Math.hypot(size.x, Math.max(size.y, this.scale ? PERSON_M : 0), size.z) + (this.scale ? 0.55 : 0.1);
      const narrow = Math.min(1, this.camera.aspect);
      const away = (0.92 * round) / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
      this.controls.target.copy(middle);
      this.camera.position.copy(middle).add(new THREE.Vector3(0.78, 0.34, 0.98).normalize().multiplyScalar(away));
      this.camera.near = away / 200;
      this.camera.far = away * 20;
      this.camera.updateProjectionMatrix();
      this.controls.update();
      this.draw();
    },
    fit() {
      const { clientWidth: width, clientHeight: height } = this.$refs.stage;
      if (!width || !height) return;
      this.renderer.setSize(width, height);
      this.names.setSize(width, height);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      this.draw();
    },
    draw() {
      if (this.queued || this.gone) return;
      this.queued = requestAnimationFrame(() => {
        this.queued = undefined;
        if (this.gone) return;
        if (this.person) this.person.rotation.y = Math.atan2(this.camera.position.x - this.person.position.x, this.camera.position.z - this.person.position.z);
        this.renderer.render(this.scene, this.camera);
        this.names.render(this.scene, this.camera);
      });
    },
    // The names a mesh may go by: a loader changes those that its animations could not address.
    namesOf(mesh) {
      const own = [];
      for (let at = mesh; at && at !== this.model; at = at.parent) own.push(at.name, at.userData?.name);
      return [...own, mesh.geometry?.name, mesh.material?.name].filter(Boolean);
    },
    highlight() {
      if (!this.model) return;
      each(this.model, (mesh) => {
        const on = Boolean(this.picked) && this.namesOf(mesh).includes(this.picked);
        if (!mesh.material.emissive) return;
        mesh.userData.glow ??= mesh.material.emissive.clone();
        mesh.material.emissive.copy(on ? new THREE.Color("#1479e0") : mesh.userData.glow);
        mesh.material.emissiveIntensity = on ? 0.4 : 1;
      });
      this.draw();
    },
    pick(event) {
      const [x, y] = this.pressed ?? [NaN, NaN];
      if (!this.model || Math.hypot(event.clientX - x, event.clientY - y) > 4) return;
      const frame = this.$refs.stage.getBoundingClientRect();
      const place = new THREE.Vector2(((x - frame.left) / frame.width) * 2 - 1, 1 - ((y - frame.top) / frame.height) * 2);
      const ray = new THREE.Raycaster();
      ray.setFromCamera(place, this.camera);
      const hit = ray.intersectObject(this.model, true)[0];
      this.$emit("part", hit ? this.namesOf(hit.object) : []);
    },
    key(event) {
      const turns = { ArrowLeft: -1, ArrowRight: 1 };
      const zooms = { ArrowUp: 0.9, ArrowDown: 1 / 0.9 };
      if (!(event.key in turns) && !(event.key in zooms)) return;
      event.preventDefault();
      event.stopPropagation();
      const offset = this.camera.position.clone().sub(this.controls.target);
      offset.applyAxisAngle(new THREE.Vector3(0, 1, 0), TURN_STEP * (turns[event.key] ?? 0)).multiplyScalar(zooms[event.key] ?? 1);
      this.camera.position.copy(this.controls.target).add(offset);
      this.controls.update();
      this.draw();
    },
    toggleScale() {
      this.scale = !this.scale;
      this.dress();
    },
    toggleWire() {
      this.wire = !this.wire;
      if (this.model) each(this.model, (mesh) => (mesh.material.wireframe = this.wire));
      this.draw();
    },
  },
};
