// Turn, zoom, cut and filter the hex mesh: plain WebGL, no library.
// The mesh comes deflated: vertices (3 float32), hexes (8 int32), the hex beyond each of the six
// faces or -1 (int32), quality (float32), one after the other.
(async () => {
  const root = document.getElementById("viewer");
  const canvas = root.querySelector("canvas");
  const given = JSON.parse(root.querySelector("script").textContent);
  const gl = canvas.getContext("webgl", { antialias: true, alpha: true });
  if (!gl || !self.DecompressionStream) {
    root.querySelector("output").textContent = "This browser shows no 3D view.";
    return;
  }

  const packed = Uint8Array.from(atob(given.data), (c) => c.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(unpacked).arrayBuffer();
  const { V, H } = given;
  const vertices = new Float32Array(buffer, 0, 3 * V);
  const hexes = new Int32Array(buffer, 12 * V, 8 * H);
  const beyond = new Int32Array(buffer, 12 * V + 32 * H, 6 * H);
  const quality = new Float32Array(buffer, 12 * V + 56 * H, H);
  const centre = new Float32Array(3 * H);
  for (let h = 0; h < H; h++)
    for (let i = 0; i < 8; i++)
      for (let k = 0; k < 3; k++) centre[3 * h + k] += vertices[3 * hexes[8 * h + i] + k] / 8;

  // ---- which faces are seen, and in which colour
  const control = (name) => root.querySelector(`[name=${name}]`);
  function colour(q) {
    const x = Math.min(Math.max(q, 0), 1) * (given.colours.length - 1);
    const i = Math.min(Math.floor(x), given.colours.length - 2);
    return given.colours[i].map((c, k) => (c + (x - i) * (given.colours[i + 1][k] - c)) / 255);
  }
  function faces() {
    const axis = ["x", "y", "z"].indexOf(control("axis").value);
    const side = control("flip").checked === given.view[2][axis] > 0 ? -1 : 1; // away from the eye
    const at = axis < 0 ? 0 : given.low[axis] + control("cut").value * (given.high[axis] - given.low[axis]);
    const most = +control("most").value;
    const kept = new Uint8Array(H);
    let count = 0;
    for (let h = 0; h < H; h++) {
      kept[h] = quality[h] <= most && (axis < 0 || side * (centre[3 * h + axis] - at) <= 1e-6);
      count += kept[h];
    }
    const seen = [];
    for (let f = 0; f < 6 * H; f++)
      if (kept[(f / 6) | 0] && (beyond[f] < 0 || !kept[beyond[f]])) seen.push(f);
    root.querySelector("output").textContent =
      `${count.toLocaleString()} of ${H.toLocaleString()} hexes, scaled Jacobian up to ${most.toFixed(2)}`;
    return seen;
  }
  let nTriangles = 0, nLines = 0;
  const triangles = gl.createBuffer(), lines = gl.createBuffer();
  function build() {
    const seen = faces();
    const t = new Float32Array(seen.length * 54), l = new Float32Array(seen.length * 24);
    seen.forEach((f, n) => {
      const h = (f / 6) | 0, c = colour(quality[h]);
      const p = given.faces[f % 6].map((i) => {
        const v = 3 * hexes[8 * h + i];
        return [vertices[v], vertices[v + 1], vertices[v + 2]];
      });
      const a = p[2].map((x, k) => x - p[0][k]), b = p[3].map((x, k) => x - p[1][k]);
      const normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
      const size = Math.hypot(...normal) || 1;
      [0, 1, 2, 0, 2, 3].forEach((i, j) =>
        t.set([...p[i], ...normal.map((x) => x / size), ...c], 54 * n + 9 * j));
      [0, 1, 1, 2, 2, 3, 3, 0].forEach((i, j) => l.set(p[i], 24 * n + 3 * j));
    });
    nTriangles = seen.length * 6;
    nLines = seen.length * 8;
    gl.bindBuffer(gl.ARRAY_BUFFER, triangles);
    gl.bufferData(gl.ARRAY_BUFFER, t, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, lines);
    gl.bufferData(gl.ARRAY_BUFFER, l, gl.DYNAMIC_DRAW);
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
    uniform float plain; varying vec3 shown;
    void main() {
      vec3 p = turn * place, n = turn * normal;
      float light = 0.5 + 0.45 * max(n.z, 0.0) + 0.25 * max(dot(n, vec3(-0.35, 0.8, 0.45)), 0.0);
      shown = mix(tint * light, vec3(0.10, 0.14, 0.18), plain);
      gl_Position = vec4(p.xy * scale + shift, -0.4 * p.z - 0.002 * plain, 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER,
    "precision mediump float; varying vec3 shown; void main() { gl_FragColor = vec4(shown, 1.0); }"));
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const attribute = (name) => gl.getAttribLocation(program, name);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(2, 2);

  let turn, zoom, shift;
  function home() { turn = given.view; zoom = 1; shift = [0, 0]; }
  function draw() {
    const ratio = self.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const size = [canvas.width, canvas.height];
    const pixels = 0.94 * zoom * Math.min(...size.map((s, k) => s / given.extent[k]));
    const fit = size.map((s) => pixels / s);
    const columns = [0, 1, 2].flatMap((j) => [0, 1, 2].map((i) => turn[i][j]));
    gl.uniformMatrix3fv(uniform("turn"), false, columns);
    gl.uniform2fv(uniform("scale"), fit);
    gl.uniform2fv(uniform("shift"), shift);
    const show = (buffer, stride, kind, count, plain) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      ["place", "normal", "tint"].forEach((name, i) => {
        gl.enableVertexAttribArray(attribute(name));
        gl.vertexAttribPointer(attribute(name), 3, gl.FLOAT, false, stride, plain ? 0 : 12 * i);
      });
      gl.uniform1f(uniform("plain"), plain);
      gl.drawArrays(kind, 0, count);
    };
    show(triangles, 36, gl.TRIANGLES, nTriangles, 0);
    if (control("edges").checked) show(lines, 12, gl.LINES, nLines, 1);
  }

  // ---- hands: one finger or button turns, two fingers or shift move and zoom, the wheel zooms
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
  });
  ["pointerup", "pointercancel"].forEach((name) =>
    canvas.addEventListener(name, (e) => fingers.delete(e.pointerId)));
  canvas.addEventListener("pointermove", (e) => {
    const old = fingers.get(e.pointerId);
    if (!old) return;
    const before = fingers.size === 2 ? spread() : 0;
    const dx = e.clientX - old[0], dy = e.clientY - old[1];
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    if (fingers.size === 2) zoom *= spread() / before;
    if (fingers.size === 2 || e.shiftKey) {
      shift = [shift[0] + (2 * dx) / canvas.clientWidth / fingers.size,
               shift[1] - (2 * dy) / canvas.clientHeight / fingers.size];
    } else {
      const [ca, sa, cb, sb] = [Math.cos(dx / 150), Math.sin(dx / 150), Math.cos(dy / 150), Math.sin(dy / 150)];
      const [r, u, t] = turn;
      const r2 = r.map((x, k) => ca * x + sa * t[k]), t2 = t.map((x, k) => ca * x - sa * r[k]);
      turn = [r2, u.map((x, k) => cb * x - sb * t2[k]), t2.map((x, k) => cb * x + sb * u[k])];
    }
    draw();
  });
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom *= Math.exp(-e.deltaY / 600);
    draw();
  }, { passive: false });
  ["axis", "flip", "cut", "most"].forEach((name) => control(name).addEventListener("input", build));
  control("edges").addEventListener("input", draw);
  control("home").addEventListener("click", () => { home(); draw(); });
  self.addEventListener("resize", draw);
  home();
  build();
})();
