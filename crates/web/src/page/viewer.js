// The page: data, camera, controls. webgpu.js and webgl2.js draw.
//
// Parameters of the address, for links and tests: api=webgpu|webgl2|picture, theme=light|dark, technique=SLUG, light=N,
// heat=1.
"use strict";

const steradian = (() => {
  const $ = (id) => document.getElementById(id);
  const parameters = new URLSearchParams(location.search);

  // ---------------------------------------------------------------------------------------------- data
  const waiting = new Map(), files = new Map();

  // Called by the scripts that hold the data: gzip, seven bits a character.
  function file(name, text) {
    const packed = new Uint8Array(text.length * 7 >> 3);
    for (let i = 0, n = 0, bits = 0, have = 0; i < text.length; i++) {
      bits = bits << 7 | text.charCodeAt(i) & 127;
      have += 7;
      if (have >= 8) packed[n++] = bits >> (have -= 8);
    }
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    new Response(stream).arrayBuffer().then((b) => waiting.get(name).done(new Uint8Array(b)), (e) => waiting.get(name).failed(e));
  }

  // The bytes of a file. A script, because pages opened from a disk may load no other data.
  function load(name) {
    if (!files.has(name)) {
      files.set(name, new Promise((done, failed) => {
        if (!self.DecompressionStream) throw new Error("this browser cannot unpack the data");
        waiting.set(name, { done, failed });
        const script = document.createElement("script");
        script.charset = "utf-8";
        script.src = name + ".js";
        script.onerror = () => { files.delete(name); failed(new Error(name + ".js cannot be loaded")); };
        document.head.append(script);
      }));
    }
    return files.get(name);
  }

  // The array at a place; first bytes of all elements come first, then second ones, and so on. Of texels of four halves
  // their differences from the texel before may be stored. Filled up to `whole` bytes.
  async function array([name, at, bytes, element, differences], whole = bytes) {
    const from = await load(name), out = new Uint8Array(Math.max(whole, bytes)), count = bytes / element;
    for (let k = 0, i = at; k < element; k++) {
      for (let j = k, n = 0; n < count; n++, j += element) out[j] = from[i++];
    }
    if (differences) {
      const halves = new Uint16Array(out.buffer, 0, bytes / 2);
      for (let i = 4; i < halves.length; i++) halves[i] += halves[i - 4];
    }
    return out;
  }

  const TEXEL = { rgba16float: 8, rgba32float: 16, rg32float: 8, rgba8unorm: 4, r32float: 4, r32uint: 4 };

  // ---------------------------------------------------------------------------------------------- vectors
  const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
  const dot = (a, b) => a.reduce((s, x, i) => s + x * b[i], 0);
  const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
  const scaled = (a, s) => a.map((x) => x * s);
  const unit = (a) => scaled(a, 1 / Math.hypot(...a));

  // ---------------------------------------------------------------------------------------------- state
  let page, api = null, sky = null, shown = null, busy = 0, queued = false;
  const state = { technique: 0, light: 0, turn: 0, ev: 0, heat: false, reference: false };
  const view = {}, home = {};
  const meshes = new Map(), uniforms = {};
  const canvas = $("view"), picture = $("picture"), status = $("status");
  const variantOf = (light, technique) => page.lights[light].variants[technique];
  const variant = () => variantOf(state.light, state.technique);

  // ---------------------------------------------------------------------------------------------- camera
  function begin({ from, at, up, fov, height }) {
    const to = add(from, at, -1), d = Math.hypot(...to), u = unit(up);
    const e = unit(Math.abs(u[1]) > 0.9 ? cross(u, [0, 0, 1]) : cross(u, [0, 1, 0]));
    Object.assign(home, {
      at, up: u, east: e, north: cross(u, e), fov, height, distance: d,
      elevation: Math.asin(dot(to, u) / d), azimuth: Math.atan2(dot(to, cross(u, e)), dot(to, e)),
    });
    Object.assign(view, home);
  }

  function axes() {
    const { up, east, north, azimuth, elevation } = view, c = Math.cos(elevation);
    const back = add(add(scaled(east, c * Math.cos(azimuth)), north, c * Math.sin(azimuth)), up, Math.sin(elevation));
    const right = unit(cross(up, back));
    return { right, up: cross(back, right), forward: scaled(back, -1), from: add(view.at, back, view.distance) };
  }

  const isHome = () => ["azimuth", "elevation", "distance"].every((k) => view[k] === home[k]) && view.at === home.at;

  function cameraBytes(width, height) {
    const { right, up, forward, from } = axes(), aspect = width / height, [w0, h0] = page.size;
    // Narrower than the pictures: the same width is seen.
    const wider = Math.max(1, w0 / h0 / aspect), parallel = view.fov === undefined;
    const film = wider * (parallel ? view.height * view.distance / home.distance : 2 * Math.tan(view.fov / 2));
    const near = view.distance * 0.01, s = 2 / film, rows = [];
    const row = (axis, k) => [...scaled(axis, k), -dot(axis, from) * k];
    rows.push(row(right, s / aspect), row(up, s));
    const along = row(forward, 1), gl = api.depthFromMinusOne;
    if (parallel) {
      // Depth over a thousand heights on both sides of the target.
      const reach = 1000 * film, z = row(forward, 1 / (2 * reach));
      z[3] += 0.5 - view.distance / (2 * reach);
      rows.push(gl ? z.map((x, k) => 2 * x - (k === 3 ? 1 : 0)) : z, [0, 0, 0, 1]);
    } else {
      rows.push(along.map((x, k) => x - (k === 3 ? (gl ? 2 : 1) * near : 0)), along);
    }
    const out = new Float32Array(48);
    for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) out[4 * j + i] = rows[i][j];
    const pixel = film / height;
    out.set([...from, parallel ? 1 : 0, ...right, film, ...up, pixel, ...forward, parallel ? 0 : pixel, width, height, 1, 1], 16);
    const [c, t] = turning();
    out.set([c, 0, t, 0, 0, 1, 0, 0, -t, 0, c, 0], 36);
    return out;
  }

  // Cosine and sine of the light's turn; techniques with data per site have a light that stands still.
  function turning() {
    const a = variant()?.turns ? state.turn * Math.PI / 180 : 0;
    return [Math.cos(a), Math.sin(a)];
  }

  function shownBytes(width, height) {
    const light = page.lights[state.light], [w0, h0] = page.size, a = width / height / (w0 / h0);
    const x = Math.max(1, a), y = Math.max(1, 1 / a);
    return new Float32Array([
      2 ** (light.ev + state.ev), 2 ** light.ev, state.heat && isHome() ? 1 : 0, 0, x, y, 0.5 - 0.5 * x, 0.5 - 0.5 * y,
    ]);
  }

  // ---------------------------------------------------------------------------------------------- resources
  async function resource(description, layers, owned) {
    if (description.uniform) {
      const u = api.uniform(await array(description.uniform));
      owned.push(u);
      return u;
    }
    const [w, h, n] = description.size;
    const t = api.texture(description, await array(description.data, w * h * n * TEXEL[description.format]), layers);
    owned.push(t);
    return t;
  }

  async function resources(descriptions, module, owned) {
    const out = {};
    for (const b of module.bindings) {
      if (descriptions[b.name]) out[b.name] = await resource(descriptions[b.name], b.layers, owned);
    }
    return out;
  }

  async function mesh(k, module) {
    if (!meshes.has(k)) meshes.set(k, await resources(page.meshes[k].resources, module, []));
    return meshes.get(k);
  }

  // Everything that a variant is drawn with. Points among its lights are kept as they were, for the light's turn.
  async function prepare(light, technique) {
    const v = variantOf(light, technique), owned = [], list = [], lights = [];
    const modules = JSON.parse(new TextDecoder().decode(await array(v.modules)));
    const programs = await Promise.all(modules.map((m) => api.program(m)));
    const behind = page.lights[light].sky, common = { ...uniforms };
    const reference = page.lights[light].reference?.texture;
    common.gpu_reference = reference ? await resource(reference, false, owned) : blank();
    const add = async (program, module, descriptions, more, vertices, solid) => {
      const own = await resources(descriptions, module, owned);
      list.push({ program, bound: api.bind(program, { ...common, ...more, ...own }), vertices, solid });
      if (own.gpu_lights) lights.push([own.gpu_lights, await array(descriptions.gpu_lights.uniform)]);
    };
    if (behind) await add(sky, page.sky, behind, {}, 3, false);
    for (const o of v.objects) {
      const module = modules[o.module];
      await add(programs[o.module], module, o.resources, await mesh(o.mesh, module), page.meshes[o.mesh].vertices, true);
    }
    return { list, owned, lights, light, technique };
  }

  let none = null;
  function blank() {
    none ??= api.texture({ format: "rgba16float", size: [1, 1, 1] }, new Uint8Array(8), false);
    return none;
  }

  // Points are in the world, surfaces are turned into the light's frame: points turn with them.
  function turnLights() {
    const [c, t] = turning();
    for (const [uniform, bytes] of shown.lights) {
      const out = bytes.slice(), floats = new Float32Array(out.buffer);
      for (let k = 0, at = 256; k < new Uint32Array(out.buffer)[0]; k++, at += 8) {
        if (floats[at + 7] > 0) {
          const [x, z] = [floats[at], floats[at + 2]];
          [floats[at], floats[at + 2]] = [c * x - t * z, t * x + c * z];
        }
      }
      api.write(uniform, out);
    }
  }

  // ---------------------------------------------------------------------------------------------- drawing
  function paint(width, height, by = (list) => api.draw(list)) {
    if (!shown) return undefined;
    if (canvas.width !== width || canvas.height !== height || !paint.sized) {
      api.resize(canvas, width, height);
      paint.sized = true;
    }
    api.write(uniforms.gpu_camera, cameraBytes(width, height));
    api.write(uniforms.gpu_shown, shownBytes(width, height));
    if (paint.turned !== turning()[1] || paint.of !== shown) turnLights();
    [paint.turned, paint.of] = [turning()[1], shown];
    return by(shown.list);
  }

  function draw() {
    if (queued || !api) return;
    queued = true;
    requestAnimationFrame(() => {
      queued = false;
      const ratio = Math.min(devicePixelRatio || 1, 2);
      const { clientWidth, clientHeight } = canvas;
      paint(Math.max(1, Math.round(clientWidth * ratio)), Math.max(1, Math.round(clientHeight * ratio)));
    });
  }

  // The picture at a size in pixels, as RGBA bytes.
  async function capture(width, height) {
    const pixels = await paint(width, height, (list) => api.read(list, width, height));
    draw();
    return pixels;
  }

  // Shows the chosen variant once it is ready; what is shown stays until then.
  async function show() {
    const mine = ++busy;
    controls();
    const v = variant();
    if (!api) {
      picture.src = state.reference ? page.lights[state.light].reference.picture : v.picture;
      status.textContent = "";
      return;
    }
    if (!shown || shown.light !== state.light || shown.technique !== state.technique) {
      const late = setTimeout(() => { if (mine === busy) status.textContent = "Loading…"; }, 250);
      try {
        const next = await prepare(state.light, state.technique);
        if (mine !== busy) {
          next.owned.forEach((r) => api.free(r));
          return;
        }
        const old = shown;
        shown = next;
        old?.owned.forEach((r) => api.free(r));
      } catch (e) {
        if (mine !== busy) return;
        fall(e);
        return;
      } finally {
        clearTimeout(late);
      }
      status.textContent = "";
      document.documentElement.dataset.ready = `${page.techniques[state.technique].slug} ${state.light}`;
    }
    overlay();
    draw();
  }

  function overlay() {
    if (!api) return;
    const reference = page.lights[state.light].reference;
    const on = state.reference && reference && isHome();
    if (on) picture.src = reference.picture;
    picture.hidden = !on;
  }

  // Without WebGPU and WebGL2: the CPU's pictures.
  function fall(why) {
    console.warn(why);
    api = null;
    shown = null;
    canvas.hidden = true;
    picture.hidden = false;
    $("note").hidden = false;
    $("note").textContent = parameters.get("api") === "picture" ? "Pictures, as the CPU has rendered them."
      : `This browser cannot draw the scene (${why.message || why}). These are pictures, as the CPU has rendered them.`;
    state.heat = false;
    document.documentElement.dataset.ready = "picture";
    show();
  }

  // A lost device: the other API, unless this one was asked for.
  function gone(Api, why) {
    if (Api !== steradian.WebGPU || parameters.get("api")) {
      fall(new Error(why));
      return;
    }
    parameters.set("api", "webgl2");
    location.search = parameters;
  }

  async function open() {
    const asked = parameters.get("api");
    const order = { webgpu: [steradian.WebGPU], webgl2: [steradian.WebGL2], picture: [] }[asked] || [steradian.WebGPU, steradian.WebGL2];
    const problems = [];
    for (const Api of order) {
      try {
        api = await Api.open(canvas, (why) => gone(Api, why));
        uniforms.gpu_camera = api.uniform(new Uint8Array(192));
        uniforms.gpu_shown = api.uniform(new Uint8Array(32));
        sky = await api.program(page.sky);
        $("api").textContent = Api.name;
        return;
      } catch (e) {
        problems.push(e.message);
        api = null;
      }
    }
    throw new Error(problems.join("; ") || "as asked");
  }

  // ---------------------------------------------------------------------------------------------- controls
  const percent = (x) => (x < 0.0995 ? (100 * x).toFixed(1) : (100 * x).toFixed(0)) + " %";

  function radio(group, index, title, small, chosen) {
    const label = document.createElement("label"), input = document.createElement("input");
    Object.assign(input, { type: "radio", name: group, value: index });
    input.addEventListener("change", () => chosen(index));
    const text = document.createElement("span"), aside = document.createElement("small");
    text.textContent = title;
    aside.textContent = small;
    label.append(input, text, aside);
    $(group).append(label);
  }

  function build() {
    document.querySelector("h1").textContent = page.title;
    $("subtitle").textContent = page.subtitle;
    $("maker").textContent = `Steradian ${page.version}`;
    canvas.setAttribute("aria-label", `${page.title}: drag to turn around it`);
    page.techniques.forEach((t, k) => radio("techniques", k, t.title, "", (i) => choose({ technique: i, reference: false })));
    if (page.lights.some((l) => l.reference)) {
      radio("techniques", -1, "Reference", "the integral itself", () => choose({ reference: true }));
      $("heat-row").hidden = false;
    }
    page.lights.forEach((l, k) => radio("lights", k, l.name, "", (i) => choose({ light: i })));
    $("lights").hidden = page.lights.length < 2;
    $("turn").addEventListener("input", (e) => turnTo(+e.target.value));
    $("exposure").addEventListener("input", (e) => { state.ev = +e.target.value; changed(); });
    $("heat").addEventListener("change", (e) => heat(e.target.checked));
    $("home").addEventListener("click", reset);
    $("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
  }

  function choose(change) {
    Object.assign(state, change);
    if (!variant()) state.technique = Math.max(0, page.lights[state.light].variants.findIndex(Boolean));
    if (!page.lights[state.light].reference) state.heat = state.reference = false;
    if (state.reference) {
      state.heat = false;
      if (api) reset();
    }
    show();
  }

  function controls() {
    const light = page.lights[state.light], v = variant(), t = page.techniques[state.technique];
    document.querySelectorAll("#techniques input").forEach((input) => {
      const k = +input.value, of = light.variants[k], small = input.parentElement.querySelector("small");
      input.checked = k < 0 ? state.reference : !state.reference && k === state.technique;
      input.disabled = k < 0 ? !light.reference : !of;
      if (k >= 0) small.textContent = !of ? "not for this light" : of.numbers ? percent(of.numbers.rms) : "";
    });
    document.querySelectorAll("#lights input").forEach((input) => { input.checked = +input.value === state.light; });
    const n = v.numbers;
    $("about").textContent = state.reference ? "Adaptive quadrature of the lighting integral, rendered for the first view."
      : [
        n ? `Relative RMS error ${percent(n.rms)} of this light's first view, ${n.stops.toFixed(2)} stops in the mean, FLIP ${n.flip.toFixed(3)}.`
          : v.certificate ? `Relative RMS error ${percent(v.certificate[0])} (${v.certificate[1]}).` : "",
        t.source,
      ].filter(Boolean).join(" ");
    $("turn").disabled = !api || !v.turns;
    $("turn").value = v.turns ? state.turn : 0;
    $("turned").textContent = v.turns ? `${Math.round(state.turn)}°` : "fixed by its data";
    $("exposure").disabled = $("home").disabled = !api;
    $("exposure").value = state.ev;
    $("exposed").textContent = `${state.ev > 0 ? "+" : ""}${state.ev.toFixed(1)} EV`;
    $("heat").disabled = !api || !light.reference;
    $("heat").checked = state.heat;
    $("legend").hidden = !state.heat;
  }

  // After a change of what is drawn without new data: away from the first view there is no reference.
  function changed() {
    if (!isHome() || (state.turn && variant().turns)) state.heat = state.reference = false;
    overlay();
    controls();
    draw();
  }

  function turnTo(degrees) {
    state.turn = ((degrees + 540) % 360) - 180;
    changed();
  }

  function heat(on) {
    state.heat = on;
    state.reference = false;
    if (on) goHome();
    changed();
  }

  function goHome() {
    Object.assign(view, home);
    state.turn = 0;
  }

  function reset() {
    goHome();
    state.ev = 0;
    changed();
  }

  function theme(name) {
    document.documentElement.dataset.theme = name;
    $("theme").textContent = name === "dark" ? "Light page" : "Dark page";
  }

  function orbit(dx, dy) {
    view.azimuth += dx;
    const lowest = page.ground ? 0.015 : -1.55;
    view.elevation = Math.min(1.55, Math.max(Math.min(lowest, home.elevation), view.elevation + dy));
    changed();
  }

  function zoom(factor) {
    view.distance = Math.min(20 * home.distance, Math.max(0.1 * home.distance, view.distance * factor));
    changed();
  }

  function pan(dx, dy) {
    const { right, up } = axes(), s = view.distance * (view.fov ? 2 * Math.tan(view.fov / 2) : 1) / canvas.clientHeight;
    view.at = add(add(view.at, right, -dx * s), up, dy * s);
    changed();
  }

  function listen() {
    const fingers = new Map();
    let apart = 0;
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      fingers.set(e.pointerId, e);
      apart = 0;
    });
    canvas.addEventListener("pointermove", (e) => {
      const last = fingers.get(e.pointerId);
      if (!last) return;
      const dx = e.clientX - last.clientX, dy = e.clientY - last.clientY;
      fingers.set(e.pointerId, e);
      if (fingers.size === 2) {
        const [a, b] = [...fingers.values()], d = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (apart > 0 && d > 0) zoom(apart / d);
        apart = d;
        pan(dx / 2, dy / 2);
      } else if (e.buttons & 2 || e.buttons & 4) {
        pan(dx, dy);
      } else if (e.shiftKey) {
        if (variant().turns) turnTo(state.turn + dx * 0.5);
      } else {
        orbit(dx * 0.008, dy * 0.008);
      }
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (e) => { fingers.delete(e.pointerId); apart = 0; });
    }
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(Math.max(-1, Math.min(1, e.deltaY * 0.0015)))); }, { passive: false });
    addEventListener("keydown", (e) => {
      if (e.ctrlKey || e.metaKey || e.altKey || e.target.matches("input[type=range]")) return;
      const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
      if (arrows && e.target.matches("input")) return;
      if (arrows && api) {
        if (!e.shiftKey) orbit(arrows[0] * 0.08, -arrows[1] * 0.08);
        else if (variant().turns) turnTo(state.turn + 5 * arrows[0]);
      } else if (e.key === "+" || e.key === "=") api && zoom(0.9);
      else if (e.key === "-") api && zoom(1 / 0.9);
      else if (e.key === "[" || e.key === "]") {
        state.ev = Math.max(-4, Math.min(4, state.ev + (e.key === "]" ? 0.5 : -0.5)));
        changed();
      } else if (e.key === "0" || e.key === "Home") api && reset();
      else if (e.key === "t" || e.key === "T") {
        const known = page.techniques.map((_, k) => k).filter((k) => variantOf(state.light, k));
        const step = e.key === "t" ? 1 : known.length - 1;
        choose({ technique: known[(known.indexOf(state.technique) + step) % known.length], reference: false });
      } else if (e.key === "l" || e.key === "L") choose({ light: (state.light + 1) % page.lights.length });
      else if (e.key === "h" && !$("heat").disabled) heat(!state.heat);
      else return;
      e.preventDefault();
    });
    new ResizeObserver(draw).observe(canvas);
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener?.("change", draw);
  }

  // Called by page.js.
  async function start(description) {
    page = description;
    begin(page.camera);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    theme(parameters.get("theme") || (dark.matches ? "dark" : "light"));
    dark.addEventListener?.("change", () => theme(dark.matches ? "dark" : "light"));
    build();
    state.light = Math.min(page.lights.length - 1, Math.max(0, Math.trunc(+parameters.get("light") || 0)));
    const named = page.techniques.findIndex((t) => t.slug === parameters.get("technique"));
    state.technique = Math.max(0, named);
    if (!variant()) state.technique = Math.max(0, page.lights[state.light].variants.findIndex(Boolean));
    // Something to look at while the data come.
    picture.src = variant().picture;
    picture.hidden = false;
    controls();
    listen();
    try {
      await open();
    } catch (e) {
      fall(e);
      return;
    }
    await show();
    if (parameters.get("heat") && api && page.lights[state.light].reference) heat(true);
  }

  return { file, page: start, capture, state, view, choose, heat, turnTo, reset, changed, orbit };
})();
