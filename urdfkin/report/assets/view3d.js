// 3D view of a robot: kinematic skeleton, joint axes, frames, and the Denavit-Hartenberg frames of a chain.
// All views of a page share one WebGL context of three.js, because browsers limit the number of contexts.
"use strict";
(() => {
  const KIND = { FIXED: 0, REVOLUTE: 1, CONTINUOUS: 2, PRISMATIC: 3, PLANAR: 4, FLOATING: 5 };
  const KIND_NAMES = ["fixed", "revolute", "continuous", "prismatic", "planar", "floating"];
  const KEY_TURN = 0.12, PICK_PIXELS = 16, MAX_PIXEL_RATIO = 2;
  const PALETTES = {
    light: { bone: 0x8e99a8, fixed: 0x9aa5b3, turn: 0x2f6fd0, slide: 0xd07a1c, free: 0x7a4fc0, pick: 0xa51d24, grid: 0xd5dbe3, normal: 0xc2348b, offset: 0x16808a },
    dark: { bone: 0x8793a3, fixed: 0x6d7886, turn: 0x6ea3ee, slide: 0xf0a04b, free: 0xb493ff, pick: 0xff9b94, grid: 0x2f3946, normal: 0xff7cc4, offset: 0x4fd0d8 },
  };
  const AXIS_COLOURS = [0xd83a3a, 0x2f9e44, 0x3563e0];
  const Z = new THREE.Vector3(0, 0, 1), Y = new THREE.Vector3(0, 1, 0);

  let printing = false;
  const isDark = () => {
    if (printing) return false;
    const chosen = document.documentElement.dataset.theme;
    return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  };
  const pose = (m) => new THREE.Matrix4().set(...m, 0, 0, 0, 1);
  const origin = (T, target = new THREE.Vector3()) => target.setFromMatrixPosition(T);
  const turns = (kind) => kind === KIND.REVOLUTE || kind === KIND.CONTINUOUS;

  // -- renderer of all views ---------------------------------------------------------------------------
  let shared;
  const renderer = () => {
    if (shared === undefined) {
      try {
        shared = new THREE.WebGLRenderer({ antialias: true, alpha: true });
        shared.setClearColor(0x000000, 0);
      } catch {
        shared = null;
      }
    }
    return shared;
  };

  // -- forward kinematics -------------------------------------------------------------------------------
  class Robot {
    constructor(data) {
      this.links = data.links;
      this.tip = data.tip;
      this.chains = data.chains;
      this.joints = data.joints.map(([name, kind, parent, child, T, axis, at, lower, upper, mimic]) => ({
        name, kind, parent, child, T: pose(T), axis: axis ? new THREE.Vector3(...axis) : null, at, lower, upper, mimic,
      }));
      this.q = new Array(data.nq).fill(0);
      this.poses = data.links.map(() => new THREE.Matrix4());
      this.start = data.start;
      this.neutral();
    }
    neutral() {
      this.q.fill(0);
      for (const joint of this.joints) if (joint.kind === KIND.FLOATING) this.q[joint.at + 6] = 1;
    }
    value(joint) {
      return joint.mimic ? joint.mimic[1] * this.q[joint.mimic[0]] + joint.mimic[2] : this.q[joint.at];
    }
    motion(joint) {
      const M = new THREE.Matrix4(), at = joint.at;
      if (turns(joint.kind)) return M.makeRotationAxis(joint.axis, this.value(joint));
      if (joint.kind === KIND.PRISMATIC) return M.makeTranslation(joint.axis.clone().multiplyScalar(this.value(joint)));
      if (joint.kind === KIND.PLANAR) return M.makeRotationZ(this.q[at + 2]).setPosition(this.q[at], this.q[at + 1], 0);
      if (joint.kind === KIND.FLOATING) {
        return M.makeRotationFromQuaternion(new THREE.Quaternion(...this.q.slice(at + 3, at + 7))).setPosition(...this.q.slice(at, at + 3));
      }
      return M;
    }
    // The parent link of a joint comes before its child link.
    move() {
      for (const joint of this.joints) {
        this.poses[joint.child].multiplyMatrices(this.poses[joint.parent], joint.T).multiply(this.motion(joint));
      }
    }
    // Return the frames of a table, and the two segments of each row: along z by d, and along x by a.
    dh(chain, convention) {
      const table = chain[convention], frames = [], normals = [], offsets = [];
      let T = this.poses[chain.base].clone().multiply(pose(table.base));
      frames.push(T.clone());
      for (const [index, a, alpha, beta, d, theta, sense] of table.rows) {
        const joint = this.joints[index], value = sense * this.value(joint), slides = joint.kind === KIND.PRISMATIC;
        const along = (segments, M) => {
          const from = origin(T);
          T = T.clone().multiply(M);
          segments.push([from, origin(T)]);
        };
        const screw = () => {
          T = T.clone().multiply(new THREE.Matrix4().makeRotationZ(theta + (slides ? 0 : value)));
          along(offsets, new THREE.Matrix4().makeTranslation(0, 0, d + (slides ? value : 0)));
        };
        const link = () => {
          along(normals, new THREE.Matrix4().makeTranslation(a, 0, 0));
          T = T.clone().multiply(new THREE.Matrix4().makeRotationX(alpha)).multiply(new THREE.Matrix4().makeRotationY(beta));
        };
        if (convention === "standard") { screw(); link(); } else { link(); screw(); }
        frames.push(T.clone());
      }
      return { frames, normals, offsets, tip: T.clone().multiply(pose(table.tool)) };
    }
  }

  // -- the drawing --------------------------------------------------------------------------------------
  class View {
    constructor(section) {
      this.section = section;
      this.canvas = section.querySelector("canvas");
      this.label = section.querySelector(".label");
      this.robot = new Robot(JSON.parse(section.querySelector("script").textContent));
      this.scene = new THREE.Scene();
      this.camera = new THREE.PerspectiveCamera(34, 1, 0.01, 100);
      this.camera.up.copy(Z);
      this.materials = {};
      for (const name of Object.keys(PALETTES.light)) this.materials[name] = new THREE.MeshLambertMaterial();
      this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 2.1));
      const sun = new THREE.DirectionalLight(0xffffff, 1.6);
      sun.position.set(2, -3, 5);
      this.scene.add(sun);
      this.robot.move();
      this.measure();
      this.build();
      this.controls = new THREE.OrbitControls(this.camera, this.canvas);
      this.controls.enableZoom = false;
      this.canvas.style.touchAction = "pan-y";
      this.controls.addEventListener("change", () => this.invalidate());
      this.look();
      this.listen();
      this.makeSliders();
      this.theme();
    }

    // Compute the size of the robot (`reach`), and the size of the symbol at each link.
    measure() {
      const box = new THREE.Box3();
      for (const T of this.robot.poses) box.expandByPoint(origin(T));
      this.reach = Math.max(box.getSize(new THREE.Vector3()).length(), 1e-3);
      box.expandByScalar(0.04 * this.reach);
      this.box = box;
      const near = this.robot.links.map(() => Infinity);
      for (const joint of this.robot.joints) {
        const length = origin(joint.T).length();
        if (length > 1e-6 * this.reach) for (const link of [joint.parent, joint.child]) near[link] = Math.min(near[link], length);
      }
      this.size = near.map((length) => Math.min(0.024 * this.reach, Math.max(0.005 * this.reach, 0.26 * (Number.isFinite(length) ? length : this.reach))));
    }

    build() {
      this.groups = this.robot.links.map(() => {
        const group = new THREE.Group();
        group.matrixAutoUpdate = false;
        this.scene.add(group);
        return group;
      });
      this.frameLines = [];
      this.axes = [];
      this.glyphs = this.robot.joints.map((joint) => this.joint(joint));
      this.robot.links.forEach((_, i) => this.groups[i].add(this.triadLines(2.6 * this.size[i])));
      this.dhParts = new THREE.Group();
      this.scene.add(this.dhParts);
      this.floor();
    }
    joint(joint) {
      const r = this.size[joint.child], group = this.groups[joint.child], parent = this.groups[joint.parent];
      const p = origin(joint.T), boneWidth = 0.32 * Math.min(r, this.size[joint.parent]);
      if (p.length() > 1e-6 * this.reach) parent.add(this.rod(new THREE.Vector3(), p, boneWidth, this.materials.bone));
      const geometry = {
        [KIND.FIXED]: () => new THREE.SphereGeometry(0.4 * r, 10, 8),
        [KIND.REVOLUTE]: () => new THREE.CylinderGeometry(r, r, 2.2 * r, 20),
        [KIND.CONTINUOUS]: () => new THREE.CylinderGeometry(1.25 * r, 1.25 * r, 1.3 * r, 20),
        [KIND.PRISMATIC]: () => new THREE.BoxGeometry(1.3 * r, 3.0 * r, 1.3 * r),
        [KIND.PLANAR]: () => new THREE.BoxGeometry(3.0 * r, 3.0 * r, 0.6 * r),
        [KIND.FLOATING]: () => new THREE.OctahedronGeometry(1.6 * r),
      }[joint.kind]();
      const material = [this.materials.fixed, this.materials.turn, this.materials.turn, this.materials.slide, this.materials.free, this.materials.free][joint.kind];
      const mesh = new THREE.Mesh(geometry, material);
      mesh.userData.material = material;
      if (joint.axis) {
        mesh.quaternion.setFromUnitVectors(Y, joint.axis);
        const line = this.rod(joint.axis.clone().multiplyScalar(-4.2 * r), joint.axis.clone().multiplyScalar(4.2 * r), 0.1 * r, material);
        const head = new THREE.Mesh(new THREE.ConeGeometry(0.34 * r, 1.1 * r, 12), material);
        head.position.copy(joint.axis).multiplyScalar(4.5 * r);
        head.quaternion.setFromUnitVectors(Y, joint.axis);
        this.axes.push(line, head);
        group.add(line, head);
      }
      group.add(mesh);
      if (joint.kind === KIND.PRISMATIC) {
        // The rail goes from the joint's origin at q = 0 to the current origin.
        joint.rail = this.rod(new THREE.Vector3(), Z, boneWidth, this.materials.slide);
        this.scene.add(joint.rail);
      }
      return mesh;
    }
    rod(from, to, radius, material) {
      const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, 1, 10), material);
      this.stretch(mesh, from, to);
      return mesh;
    }
    stretch(mesh, from, to) {
      const along = to.clone().sub(from), length = along.length();
      mesh.visible = length > 1e-9;
      mesh.position.copy(from).addScaledVector(along, 0.5);
      if (mesh.visible) mesh.quaternion.setFromUnitVectors(Y, along.divideScalar(length));
      mesh.scale.set(1, Math.max(length, 1e-9), 1);
    }
    triadLines(length) {
      const points = [], colours = [];
      AXIS_COLOURS.forEach((colour, k) => {
        const c = new THREE.Color(colour), end = [0, 0, 0];
        end[k] = length;
        points.push(0, 0, 0, ...end);
        colours.push(c.r, c.g, c.b, c.r, c.g, c.b);
      });
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
      geometry.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
      const lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true }));
      lines.visible = false;
      this.frameLines.push(lines);
      return lines;
    }
    triadArrows(length) {
      const group = new THREE.Group();
      group.matrixAutoUpdate = false;
      [0, 1, 2].forEach((k) => {
        const way = new THREE.Vector3().setComponent(k, 1), thick = k === 1 ? 0.02 : 0.035;
        const material = new THREE.MeshLambertMaterial({ color: AXIS_COLOURS[k] });
        const head = new THREE.Mesh(new THREE.ConeGeometry(2.4 * thick * length, 0.24 * length, 12), material);
        head.position.copy(way).multiplyScalar(length);
        head.quaternion.setFromUnitVectors(Y, way);
        group.add(this.rod(new THREE.Vector3(), way.clone().multiplyScalar(0.9 * length), thick * length, material), head);
      });
      return group;
    }
    floor() {
      const bottom = Math.min(0, this.box.min.z), step = 10 ** Math.floor(Math.log10(this.reach)) / 2;
      const cells = 2 * Math.ceil((0.75 * this.reach) / step), grid = new THREE.GridHelper(cells * step, cells);
      grid.rotation.x = Math.PI / 2;
      grid.position.z = bottom;
      grid.material = new THREE.LineBasicMaterial();
      grid.geometry.deleteAttribute("color");
      this.grid = grid;
      this.scene.add(grid);
    }

    // -- Denavit-Hartenberg frames: rebuilt when the chain changes, moved when a joint moves --------------
    chosen() {
      const chain = this.section.querySelector("[data-chain]");
      return chain ? [this.robot.chains[chain.value], this.section.querySelector("[data-convention]").value] : null;
    }
    buildDh() {
      this.dhParts.clear();
      this.dhState = null;
      const chosen = this.chosen();
      if (!chosen) return;
      const { frames, normals, offsets } = this.robot.dh(...chosen), length = 0.09 * this.reach, thick = 0.0045 * this.reach;
      const rods = (segments, material) => segments.map(([from, to]) => this.rod(from, to, thick, material));
      this.dhState = {
        frames: frames.map(() => this.triadArrows(length)),
        normals: rods(normals, this.materials.normal),
        offsets: rods(offsets, this.materials.offset),
      };
      this.dhParts.add(...Object.values(this.dhState).flat());
    }
    moveDh() {
      if (!this.dhState || !this.dhParts.visible) return;
      const { frames, normals, offsets } = this.robot.dh(...this.chosen());
      frames.forEach((T, i) => {
        this.dhState.frames[i].matrix.copy(T);
        this.dhState.frames[i].matrixWorldNeedsUpdate = true;
      });
      normals.forEach(([from, to], i) => this.stretch(this.dhState.normals[i], from, to));
      offsets.forEach(([from, to], i) => this.stretch(this.dhState.offsets[i], from, to));
    }

    // -- moving -----------------------------------------------------------------------------------------
    update() {
      this.robot.move();
      this.robot.poses.forEach((T, i) => {
        this.groups[i].matrix.copy(T);
        this.groups[i].matrixWorldNeedsUpdate = true;
      });
      for (const joint of this.robot.joints) {
        if (joint.rail) this.stretch(joint.rail, origin(this.robot.poses[joint.parent].clone().multiply(joint.T)), origin(this.robot.poses[joint.child]));
      }
      this.moveDh();
      this.invalidate();
    }
    // Look from a fixed direction, at the smallest distance at which the origins of all links are visible.
    look() {
      this.touched = false;
      const width = this.canvas.clientWidth || 1, height = this.canvas.clientHeight || 1, margin = 1.28;
      const away = new THREE.Vector3(1.0, -1.35, 0.62).normalize(), centre = this.box.getCenter(new THREE.Vector3());
      const right = new THREE.Vector3().crossVectors(Z, away).normalize(), up = new THREE.Vector3().crossVectors(away, right);
      const tall = Math.tan((this.camera.fov * Math.PI) / 360), wide = (tall * width) / height, p = new THREE.Vector3();
      let distance = 0.1 * this.reach;
      for (const T of this.robot.poses) {
        origin(T, p).sub(centre);
        const needed = margin * Math.max(Math.abs(p.dot(right)) / wide, Math.abs(p.dot(up)) / tall);
        distance = Math.max(distance, p.dot(away) + needed);
      }
      distance += 0.05 * this.reach;
      this.controls.target.copy(centre);
      this.camera.position.copy(away.multiplyScalar(distance)).add(centre);
      Object.assign(this.camera, { near: distance / 200, far: distance * 20 });
      this.controls.update();
      this.invalidate();
    }
    turn(azimuth, polar, zoom = 1) {
      this.touched = true;
      const away = this.camera.position.clone().sub(this.controls.target);
      const ball = new THREE.Spherical().setFromCartesianCoords(away.x, away.z, -away.y);
      ball.theta += azimuth;
      ball.phi = Math.min(Math.PI - 0.01, Math.max(0.01, ball.phi + polar));
      ball.radius *= zoom;
      const to = new THREE.Vector3().setFromSpherical(ball);
      this.camera.position.set(to.x, -to.z, to.y).add(this.controls.target);
      this.controls.update();
      this.invalidate();
    }
    listen() {
      const canvas = this.canvas, section = this.section;
      canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
      canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
      canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
      canvas.addEventListener("keydown", (event) => {
        const act = {
          ArrowLeft: [-KEY_TURN, 0], ArrowRight: [KEY_TURN, 0], ArrowUp: [0, -KEY_TURN], ArrowDown: [0, KEY_TURN],
          "+": [0, 0, 0.88], "=": [0, 0, 0.88], "-": [0, 0, 1 / 0.88],
        }[event.key];
        if (!act || event.ctrlKey || event.metaKey) return;
        event.preventDefault();
        this.turn(...act);
      });
      canvas.addEventListener("pointermove", (event) => { if (!event.buttons) this.hover(event); });
      canvas.addEventListener("pointerleave", () => this.pick(null));
      for (const box of section.querySelectorAll("[data-show]")) box.addEventListener("change", () => this.show());
      for (const choice of section.querySelectorAll("[data-chain], [data-convention]")) {
        choice.addEventListener("change", () => { this.buildDh(); this.update(); });
      }
      section.querySelector("[data-do=neutral]").addEventListener("click", () => this.neutral());
      section.querySelector("[data-do=random]").addEventListener("click", () => this.random());
      section.querySelector("[data-do=view]").addEventListener("click", () => this.look());
      document.addEventListener("themechange", () => this.theme());
      this.controls.addEventListener("start", () => { this.touched = true; });
      new ResizeObserver(() => (this.touched ? this.invalidate() : this.look())).observe(canvas);
      this.buildDh();
      this.show();
    }
    show() {
      const on = (what) => this.section.querySelector(`[data-show=${what}]`)?.checked ?? false;
      for (const part of this.axes) part.visible = on("axes");
      for (const part of this.frameLines) part.visible = on("frames");
      this.grid.visible = on("grid");
      this.dhParts.visible = on("dh");
      const legend = this.section.querySelector(".dhkey");
      if (legend) legend.hidden = !on("dh");
      // The robot is transparent while the frames of the tables are shown, because joints cover these frames.
      for (const name of ["bone", "fixed", "turn", "slide", "free"]) {
        Object.assign(this.materials[name], { transparent: on("dh"), opacity: on("dh") ? 0.32 : 1, depthWrite: !on("dh"), needsUpdate: true });
      }
      this.update();
    }
    theme() {
      const palette = PALETTES[isDark() ? "dark" : "light"];
      for (const [name, material] of Object.entries(this.materials)) material.color.set(palette[name]);
      this.grid.material.color.set(palette.grid);
      this.invalidate();
    }

    // -- joints under the pointer or the slider -----------------------------------------------------------
    hover(event) {
      const area = this.canvas.getBoundingClientRect(), at = new THREE.Vector3();
      let best = null, nearest = PICK_PIXELS;
      for (const joint of this.robot.joints) {
        origin(this.robot.poses[joint.child], at).project(this.camera);
        const dx = ((at.x + 1) / 2) * area.width - (event.clientX - area.left), dy = ((1 - at.y) / 2) * area.height - (event.clientY - area.top);
        const distance = Math.hypot(dx, dy) + (joint.kind === KIND.FIXED ? 5 : 0);
        if (distance < nearest) [best, nearest] = [joint, distance];
      }
      this.pick(best);
    }
    pick(joint) {
      if (joint === this.picked) return;
      for (const [one, on] of [[this.picked, false], [joint, true]]) {
        const mesh = one && this.glyphs[this.robot.joints.indexOf(one)];
        if (!mesh) continue;
        mesh.material = on ? this.materials.pick : mesh.userData.material;
        mesh.scale.setScalar(on ? 1.35 : 1);
      }
      this.picked = joint;
      this.label.hidden = !joint;
      this.label.textContent = joint ? `${joint.name}, ${KIND_NAMES[joint.kind]}` : "";
      this.invalidate();
    }

    // -- sliders --------------------------------------------------------------------------------------
    makeSliders() {
      const box = this.section.querySelector(".sliders");
      this.sliders = [];
      for (const joint of this.robot.joints) {
        if (joint.mimic || joint.at < 0 || joint.kind === KIND.FLOATING) continue;
        if (joint.kind === KIND.PLANAR) {
          ["x", "y", "angle"].forEach((part, k) => this.slider(box, joint, `${joint.name} ${part}`, joint.at + k, k < 2 ? [-1, 1] : [-Math.PI, Math.PI], k === 2));
        } else {
          const whole = turns(joint.kind) ? Math.PI : 1, bounds = joint.kind === KIND.CONTINUOUS ? [null, null] : [joint.lower, joint.upper];
          this.slider(box, joint, joint.name, joint.at, [bounds[0] ?? -whole, bounds[1] ?? whole], turns(joint.kind));
        }
      }
      if (!this.sliders.length) box.textContent = "No joint moves.";
      if (!this.robot.start) return this.neutral();
      this.robot.q = [...this.robot.start];
      this.setSliders();
    }
    slider(box, joint, name, at, [min, max], isAngle) {
      const label = document.createElement("label"), words = document.createElement("span"), output = document.createElement("output");
      const input = Object.assign(document.createElement("input"), { type: "range", min, max, step: "any", value: 0 });
      words.textContent = words.title = name;
      // The label belongs to its first control, so the slider comes before the output.
      label.append(words, input, output);
      input.ariaLabel = name;
      box.append(label);
      const tell = () => { output.textContent = isAngle ? `${((this.robot.q[at] * 180) / Math.PI).toFixed(1)}°` : `${this.robot.q[at].toFixed(4)} m`; input.ariaValueText = output.textContent; };
      input.addEventListener("input", () => { this.robot.q[at] = Number(input.value); tell(); this.update(); });
      for (const [event, on] of [["focus", true], ["pointerenter", true], ["blur", false], ["pointerleave", false]]) {
        input.addEventListener(event, () => this.pick(on ? joint : null));
      }
      this.sliders.push({ at, min, max, set: () => { input.value = this.robot.q[at]; tell(); } });
    }
    // Set each joint to zero, or to the limit nearest to zero, so that the sliders show the drawn configuration.
    neutral() {
      this.robot.neutral();
      for (const { at, min, max } of this.sliders) this.robot.q[at] = Math.min(Math.max(this.robot.q[at], min), max);
      this.setSliders();
    }
    setSliders() {
      for (const slider of this.sliders) slider.set();
      this.update();
    }
    random() {
      for (const { at, min, max } of this.sliders) this.robot.q[at] = min + Math.random() * (max - min);
      this.setSliders();
    }

    // -- pixels ---------------------------------------------------------------------------------------
    invalidate() {
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; this.render(); });
    }
    render() {
      const gl = renderer(), ratio = Math.min(devicePixelRatio || 1, MAX_PIXEL_RATIO);
      const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
      if (!gl || !width || !height) return;
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      gl.setSize(width, height, false);
      gl.render(this.scene, this.camera);
      if (this.canvas.width !== width) this.canvas.width = width;
      if (this.canvas.height !== height) this.canvas.height = height;
      const context = this.canvas.getContext("2d");
      context.clearRect(0, 0, width, height);
      context.drawImage(gl.domElement, 0, 0);
      this.canvas.dataset.drawn = Number(this.canvas.dataset.drawn || 0) + 1;
    }
  }

  // A view starts when it first becomes visible, or when the page is printed.
  const start = (target) => {
    watcher.unobserve(target);
    if (renderer()) target.view = new View(target);
    else {
      target.querySelector(".fallback").hidden = false;
      target.querySelectorAll("canvas, .hint, .panel").forEach((part) => { part.hidden = true; });
    }
  };
  const watcher = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) if (isIntersecting) start(target);
  }, { rootMargin: "200px" });
  // A printed page has light colours in every theme. The drawing must be complete when the event handler returns.
  const redraw = (onPaper) => {
    printing = onPaper;
    for (const target of document.querySelectorAll("[data-view]")) {
      if (onPaper && !target.view && target.checkVisibility()) start(target);
      target.view?.theme();
      if (onPaper) target.view?.render();
    }
  };
  addEventListener("beforeprint", () => redraw(true));
  addEventListener("afterprint", () => redraw(false));
  const watch = (part) => part.querySelectorAll("[data-view]").forEach((section) => watcher.observe(section));
  watch(document);
  document.addEventListener("robotloaded", (event) => watch(event.detail));
})();
