// Turn, zoom, cut, filter, colour and ask the hex mesh: plain WebGL, no library.
// The mesh comes deflated: vertices (3 float32), hexes (8 int32), the hex beyond each of the six
// faces, -1 outside, -2 where it is left out (int32), quality (float32), distance from the input per
// face or -1 (6 float32), cell (int32), combination of named sets per face or -1 (6 int32),
// number of the hex (int32), one after the other; then the input surface, vertices (3 float32) and
// triangles (3 int32), and for each result a value per vertex (uint16) and, if it moves the part,
// a displacement (3 int16).  Hexes, those beyond, cells, numbers and triangles come as differences
// of the rows.
(async () => {
  const root = document.currentScript.parentElement;
  const canvas = root.querySelector("canvas");
  const told = root.querySelector("output");
  const given = JSON.parse(root.querySelector("script").textContent);
  const options = { antialias: true, alpha: true, preserveDrawingBuffer: true };
  const gl = canvas.getContext("webgl", options);
  if (!gl || !self.DecompressionStream) {
    told.textContent = "This browser shows no 3D view.";
    return;
  }

  const packed = Uint8Array.from(atob(given.data), (c) => c.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(unpacked).arrayBuffer();
  const { V, H } = given;
  const vertices = new Float32Array(buffer, 0, 3 * V);
  function sums(start, width, rows = H) {
    const found = new Int32Array(buffer, start, width * rows);
    for (let i = width; i < found.length; i++) found[i] += found[i - width];
    return found;
  }
  const hexes = sums(12 * V, 8);
  const beyond = sums(12 * V + 32 * H, 6);
  const quality = new Float32Array(buffer, 12 * V + 56 * H, H);
  const distance = new Float32Array(buffer, 12 * V + 60 * H, 6 * H);
  const cell = sums(12 * V + 84 * H, 1);
  const sets = new Int32Array(buffer, 12 * V + 88 * H, 6 * H);
  const number = sums(12 * V + 112 * H, 1);
  const { S, T } = given;
  let end = 12 * V + 116 * H; // of what is read so far
  const places = new Float32Array(buffer, end, 3 * S);
  const triangles = sums((end += 12 * S), 3, T);
  end += 12 * T;
  for (const result of given.results) {
    result.values = new Uint16Array(buffer, end, V);
    end += 2 * V;
    if (!result.moves) continue;
    result.shifts = new Int16Array(buffer, end, 3 * V);
    end += 6 * V;
  }
  const centre = new Float32Array(3 * H);
  for (let h = 0; h < H; h++)
    for (let i = 0; i < 8; i++)
      for (let k = 0; k < 3; k++) centre[3 * h + k] += vertices[3 * hexes[8 * h + i] + k] / 8;
  const drawn = vertices.slice(); // deformed by the result that is shown
  const corners = (f) => given.faces[f % 6].map((i) => {
    const v = 3 * hexes[8 * ((f / 6) | 0) + i];
    return [drawn[v], drawn[v + 1], drawn[v + 2]];
  });

  // ---- which faces are seen, and in which colour
  const control = (name) => root.querySelector(`[name=${name}]`);
  const chosen = { from: -1, to: 1, hex: -1 }; // range of quality, and the one hex asked for
  const INSIDE = [0.72, 0.75, 0.78];
  function ramp(stops, share) {
    const x = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
    const i = Math.min(Math.floor(x), stops.length - 2);
    return stops[i].map((c, k) => (c + (x - i) * (stops[i + 1][k] - c)) / 255);
  }
  function colour(f) {
    const h = (f / 6) | 0;
    switch (control("colour").value) {
      case "distance":
        return distance[f] < 0 ? INSIDE : ramp(given.far, distance[f] / (given.farthest || 1));
      case "cell":
        return given.cells[cell[h] % given.cells.length].map((c) => c / 255);
      case "primitive":
        return given.cells[given.primitive[cell[h]] % given.cells.length].map((c) => c / 255);
      case "set":
        return sets[f] < 0 ? INSIDE : given.set_colours[sets[f]].map((c) => c / 255);
      default:
        return ramp(given.colours, quality[h]);
    }
  }
  const result = () => given.results[control("colour").value.replace("result", "")];
  const SHARE = 65534; // the value at the end of the colour bar
  function tints(f) { // the colours of the four corners
    const shown = result();
    if (!shown) return Array(4).fill(colour(f));
    return given.faces[f % 6].map((i) =>
      ramp(shown.stops, shown.values[hexes[8 * ((f / 6) | 0) + i]] / SHARE));
  }
  function deform() {
    const shown = result();
    const slider = control("deformed");
    if (slider) slider.disabled = !shown?.moves;
    const length = shown?.moves ? (slider.value * given.amplitude) / 32767 : 0;
    for (let i = 0; i < 3 * V; i++) drawn[i] = vertices[i] + (length ? length * shown.shifts[i] : 0);
  }
  function exaggerated() {
    const shown = result();
    return shown?.drawn && control("deformed").value == 1 ? `; ${shown.drawn}` : "";
  }
  let seen = [];
  function isKept() { // by the cut: a function of the places and the number of a point
    const axis = ["x", "y", "z"].indexOf(control("axis").value);
    const side = control("flip").checked === given.view[2][axis] > 0 ? -1 : 1; // away from the eye
    const at = axis < 0 ? 0 : given.low[axis] + control("cut").value * (given.high[axis] - given.low[axis]);
    return (points, i) => axis < 0 || side * (points[3 * i + axis] - at) <= 1e-6;
  }
  function choose() {
    const isBehind = isKept();
    const most = Math.min(chosen.to, +control("most").value);
    const kept = new Uint8Array(H);
    let count = 0;
    for (let h = 0; h < H; h++) {
      kept[h] = quality[h] <= most && quality[h] >= chosen.from && (chosen.hex < 0 || h === chosen.hex)
        && isBehind(centre, h);
      count += kept[h];
    }
    seen = [];
    for (let f = 0; f < 6 * H; f++)
      if (kept[(f / 6) | 0] && (beyond[f] < 0 ? beyond[f] === -1 || count < H : !kept[beyond[f]])) seen.push(f);
    const from = chosen.from > -1 ? `${chosen.from.toFixed(2)} to ` : most < 1 ? "up to " : "";
    const range = from ? `, scaled Jacobian ${from}${most.toFixed(2)}` : "";
    const rest = H < given.all ? "; of the inner hexes, only the worst are in this page" : "";
    if (chosen.hex < 0) told.textContent = `${count.toLocaleString("en")} of ${given.all.toLocaleString("en")} hexes${range}${rest}${exaggerated()}`;
    return count < H;
  }
  const buffers = {}, counts = {};
  for (const name of ["triangles", "lines", "ghost", "lost", "input"]) {
    buffers[name] = gl.createBuffer();
    counts[name] = 0;
  }
  function fill(name, data, size) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    counts[name] = data.length / size;
  }
  function polygons(faces) {
    const t = new Float32Array(faces.length * 54);
    faces.forEach((f, n) => {
      const p = corners(f), c = tints(f), n0 = across(p[0], p[2], p[1], p[3]);
      [0, 1, 2, 0, 2, 3].forEach((i, j) => t.set([...p[i], ...n0, ...c[i]], 54 * n + 9 * j));
    });
    return t;
  }
  function across(p, q, r, s) { // the unit normal of pq and rs
    const a = q.map((x, k) => x - p[k]), b = s.map((x, k) => x - r[k]);
    const normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const size = Math.hypot(...normal) || 1;
    return normal.map((x) => x / size);
  }
  const FILM = [0.95, 0.55, 0.1]; // the input surface
  function film() { // its triangles behind the cut
    const isBehind = isKept(), found = [];
    for (let t = 0; t < T; t++) {
      const corner = [...triangles.subarray(3 * t, 3 * t + 3)];
      const p = corner.map((v) => [...places.subarray(3 * v, 3 * v + 3)]);
      if (!isBehind([0, 1, 2].map((k) => (p[0][k] + p[1][k] + p[2][k]) / 3), 0)) continue;
      const normal = across(p[0], p[1], p[0], p[2]);
      for (const each of p) found.push(...each, ...normal, ...FILM);
    }
    return new Float32Array(found);
  }
  const hasFilm = () => T && control("input").checked;
  const outside = [];
  for (let f = 0; f < 6 * H; f++) if (beyond[f] === -1) outside.push(f);
  let isPart = false;
  function build() {
    isPart = choose();
    deform();
    if (hasFilm()) fill("input", film(), 9);
    if (isPart) fill("ghost", polygons(outside), 9);
    const l = new Float32Array(seen.length * 24);
    seen.forEach((f, n) => {
      const p = corners(f);
      [0, 1, 1, 2, 2, 3, 3, 0].forEach((i, j) => l.set(p[i], 24 * n + 3 * j));
    });
    fill("triangles", polygons(seen), 9);
    fill("lines", l, 3);
    root.querySelectorAll("[data-colour]").forEach((legend) => {
      legend.hidden = legend.dataset.colour !== control("colour").value;
    });
    draw();
  }

  // ---- drawing
  function shader(type, source) {
    const made = gl.createShader(type);
    gl.shaderSource(made, source);
    gl.compileShader(made);
    return made;
  }
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    attribute vec3 place, normal, tint; uniform mat3 turn; uniform vec2 scale, shift;
    uniform float plain; uniform vec3 ink; varying vec3 shown;
    void main() {
      vec3 p = turn * place, n = turn * normal;
      float light = 0.5 + 0.45 * max(n.z, 0.0) + 0.25 * max(dot(n, vec3(-0.35, 0.8, 0.45)), 0.0);
      shown = mix(tint * light, ink, plain);
      gl_Position = vec4(p.xy * scale + shift, -0.4 * p.z - 0.002 * plain, 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    precision mediump float; varying vec3 shown; uniform float ghost, clear;
    void main() { gl_FragColor = mix(vec4(shown, 1.0) * (1.0 - clear), vec4(0.06, 0.065, 0.07, 0.12), ghost); }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const attribute = (name) => gl.getAttribLocation(program, name);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(2, 2);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  let turn, zoom, shift, fit;
  function home() { turn = given.view; zoom = 1; shift = [0, 0]; }
  function look() { // from a new place, as all views of the page
    draw();
    document.dispatchEvent(new CustomEvent("look", { detail: { root, turn, zoom, shift } }));
  }
  document.addEventListener("look", ({ detail }) => {
    if (detail.root === root) return;
    ({ turn, zoom, shift } = detail);
    draw();
  });
  function draw() {
    const ratio = self.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const size = [canvas.width, canvas.height];
    const pixels = 0.94 * zoom * Math.min(...size.map((s, k) => s / given.extent[k]));
    fit = size.map((s) => pixels / s);
    const columns = [0, 1, 2].flatMap((j) => [0, 1, 2].map((i) => turn[i][j]));
    gl.uniformMatrix3fv(uniform("turn"), false, columns);
    gl.uniform2fv(uniform("scale"), fit);
    gl.uniform2fv(uniform("shift"), shift);
    const show = (name, kind, plain, ghost, ink = [0.1, 0.14, 0.18]) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
      ["place", "normal", "tint"].forEach((each, i) => {
        gl.enableVertexAttribArray(attribute(each));
        gl.vertexAttribPointer(attribute(each), 3, gl.FLOAT, false, plain ? 12 : 36, plain ? 0 : 12 * i);
      });
      gl.uniform1f(uniform("plain"), plain);
      gl.uniform1f(uniform("ghost"), ghost);
      gl.uniform3fv(uniform("ink"), ink);
      gl.drawArrays(kind, 0, counts[name]);
    };
    gl.uniform1f(uniform("clear"), 0);
    show("triangles", gl.TRIANGLES, 0, 0);
    if (control("edges").checked) { // without the offset, which some drivers also apply to lines
      gl.disable(gl.POLYGON_OFFSET_FILL);
      show("lines", gl.LINES, 1, 0);
      gl.enable(gl.POLYGON_OFFSET_FILL);
    }
    if (isPart) { // the rest of the part, as a shade
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      show("ghost", gl.TRIANGLES, 0, 1);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
    if (hasFilm()) { // the input, as a film before the faces that lie in it
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      gl.disable(gl.POLYGON_OFFSET_FILL);
      gl.uniform1f(uniform("clear"), 0.6);
      show("input", gl.TRIANGLES, 0, 0);
      gl.uniform1f(uniform("clear"), 0);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
    if (counts.lost && control("lost").checked) { // seen through the part, and two pixels wide
      gl.disable(gl.DEPTH_TEST);
      for (const step of [-1, 1]) {
        gl.uniform2fv(uniform("shift"), [shift[0] + step / size[0], shift[1] + step / size[1]]);
        show("lost", gl.LINES, 1, 0, [0.85, 0.1, 0.1]);
      }
      gl.enable(gl.DEPTH_TEST);
    }
  }

  // ---- asking: the face under a finger, the worst one, those of a bar of the histogram
  const onScreen = (p) => [0, 1].map((k) => fit[k] * p.reduce((s, x, j) => s + turn[k][j] * x, 0) + shift[k]);
  const depth = (p) => p.reduce((s, x, j) => s + turn[2][j] * x, 0);
  function under(x, y) {
    let best = -1, nearest = -Infinity;
    for (const f of seen) {
      const p = corners(f), q = p.map(onScreen);
      let inside = false;
      for (let i = 0, j = 3; i < 4; j = i++)
        if (q[i][1] > y !== q[j][1] > y &&
            x < ((q[j][0] - q[i][0]) * (y - q[i][1])) / (q[j][1] - q[i][1]) + q[i][0]) inside = !inside;
      const z = p.reduce((s, each) => s + depth(each), 0);
      if (inside && z > nearest) { nearest = z; best = f; }
    }
    return best;
  }
  function describe(h, f = -1) {
    const at = [0, 1, 2].map((k) => +(given.middle[k] + given.size * centre[3 * h + k]).toPrecision(4));
    const filled = given.names[given.primitive[cell[h]]];
    const named = sets[f] >= 0 ? given.sets[sets[f]] : "";
    told.textContent = `hex ${number[h]}: scaled Jacobian ${quality[h].toFixed(3)}, at (${at.join(", ")}), ` +
      `cell ${cell[h]}${filled ? `, ${filled}` : ""}` +
      (named ? `; in ${named}` : "") + (f < 0 ? "" : resultAt(f));
  }
  function resultAt(f) { // the mean over the corners of a face, as far as the colour bar goes
    const shown = result();
    if (!shown?.unit) return "";
    const sum = given.faces[f % 6].reduce((s, i) => s + shown.values[hexes[8 * ((f / 6) | 0) + i]], 0);
    const value = shown.ends[0] + (sum / 4 / SHARE) * (shown.ends[1] - shown.ends[0]);
    return `; ${shown.title} ${value.toPrecision(4)} ${shown.unit}`;
  }
  function all() {
    Object.assign(chosen, { from: -1, to: 1, hex: -1 });
    control("most").value = 1;
    control("axis").value = "";
  }
  document.querySelectorAll(".histogram button").forEach((bar) => bar.addEventListener("click", () => {
    all();
    Object.assign(chosen, { from: +bar.dataset.low, to: +bar.dataset.high });
    build();
    root.scrollIntoView({ block: "nearest" });
  }));
  control("worst").addEventListener("click", () => {
    all();
    chosen.hex = quality.reduce((least, q, h) => (q < quality[least] ? h : least), 0);
    build();
    describe(chosen.hex);
  });

  // ---- hands: one finger or button turns, two fingers or shift move and zoom, the wheel zooms
  const fingers = new Map();
  let moved = 0;
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  function rotate(dx, dy) {
    const [ca, sa, cb, sb] = [Math.cos(dx / 150), Math.sin(dx / 150), Math.cos(dy / 150), Math.sin(dy / 150)];
    const [r, u, t] = turn;
    const r2 = r.map((x, k) => ca * x + sa * t[k]), t2 = t.map((x, k) => ca * x - sa * r[k]);
    turn = [r2, u.map((x, k) => cb * x - sb * t2[k]), t2.map((x, k) => cb * x + sb * u[k])];
  }
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    moved = 0;
  });
  canvas.addEventListener("pointercancel", (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("pointerup", (e) => {
    fingers.delete(e.pointerId);
    if (moved > 4) return;
    const box = canvas.getBoundingClientRect();
    const f = under((2 * (e.clientX - box.x)) / box.width - 1, 1 - (2 * (e.clientY - box.y)) / box.height);
    if (f >= 0) describe((f / 6) | 0, f);
  });
  canvas.addEventListener("pointermove", (e) => {
    const old = fingers.get(e.pointerId);
    if (!old) return;
    const before = fingers.size === 2 ? spread() : 0;
    const dx = e.clientX - old[0], dy = e.clientY - old[1];
    moved += Math.abs(dx) + Math.abs(dy);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    if (fingers.size === 2) zoom *= spread() / before;
    if (fingers.size === 2 || e.shiftKey) {
      shift = [shift[0] + (2 * dx) / canvas.clientWidth / fingers.size,
               shift[1] - (2 * dy) / canvas.clientHeight / fingers.size];
    } else rotate(dx, dy);
    look();
  });
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom *= Math.exp(-e.deltaY / 600);
    look();
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const step = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[e.key];
    if (!step) return;
    e.preventDefault();
    rotate(...step);
    look();
  });
  control("cut").addEventListener("input", () => { if (!control("axis").value) control("axis").value = "x"; });
  ["axis", "flip", "cut", "most", "colour", "input", "deformed"].forEach((name) => control(name)?.addEventListener("input", () => {
    chosen.hex = -1;
    build();
  }));
  control("edges").addEventListener("input", draw);
  if (control("lost")) control("lost").addEventListener("input", draw);
  control("home").addEventListener("click", () => { home(); all(); build(); });
  self.addEventListener("resize", draw);
  self.addEventListener("beforeprint", () =>
    document.querySelectorAll("details:not(.long)").forEach((each) => { each.open = true; }));
  home();
  fill("lost", new Float32Array(given.lost), 3);
  build();
})();
