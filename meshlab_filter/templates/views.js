const EXPLAINED = {
  error: ["Error, share of the diagonal", "The scale ends at the 99th percentile; what is above has its colour. On the points that stay and on the surface: the largest error nearby."],
  rank: ["Rank", "Points of low rank go first; those of the highest stay longest."],
  entropy: ["Entropy of the point's cluster, nats", "Clusters of low entropy go first. A cluster of a single point has none and is drawn as the highest."],
};
const DISTANCE = 1.9, START = {turn: -1.1, lift: 0.35};
const plots = [];
let camera = {...START, distance: DISTANCE};

function eyeOf({turn, lift, distance}) {
  return {
    x: distance * Math.cos(lift) * Math.cos(turn),
    y: distance * Math.cos(lift) * Math.sin(turn),
    z: distance * Math.sin(lift),
  };
}

function polar(eye) {
  const distance = Math.hypot(eye.x, eye.y, eye.z);
  return {turn: Math.atan2(eye.y, eye.x), lift: Math.asin(eye.z / distance), distance};
}

function extent(arrays) {
  let low = Infinity, high = -Infinity;
  for (const array of arrays) for (const value of array) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
}

// Inside a plot z is always up, so that turning keeps the horizon.
function oriented(view, up) {
  return up === "z" ? {x: view.x, y: view.y, z: view.z} : {x: view.x, y: view.z.map((value) => -value), z: view.y};
}

function sceneOf(up) {
  const placed = plots.map(({view}) => oriented(view, up));
  const ranges = ["x", "y", "z"].map((axis) => extent(placed.map((each) => each[axis])));
  const longest = Math.max(...ranges.map(([low, high]) => high - low)) || 1;
  const padded = ranges.map(([low, high]) => [low - 0.01 * longest, high + 0.01 * longest]);
  const sides = padded.map(([low, high]) => (high - low) / longest);
  const diagonal = Math.hypot(...sides);
  const hidden = {visible: false, showspikes: false};
  return {
    xaxis: {...hidden, range: padded[0]}, yaxis: {...hidden, range: padded[1]}, zaxis: {...hidden, range: padded[2]},
    aspectmode: "manual",
    aspectratio: {x: 1.6 * sides[0] / diagonal, y: 1.6 * sides[1] / diagonal, z: 1.6 * sides[2] / diagonal},
    camera: {eye: eyeOf(camera), up: {x: 0, y: 0, z: 1}, center: {x: 0, y: 0, z: 0}},
    dragmode: "turntable", bgcolor: "#b9c0ca",
  };
}

function traceOf(view, colour, up) {
  const value = view.values[colour];
  const shade = {colorscale: payload.colorscale, cmin: value.low, cmax: value.high > value.low ? value.high : value.low + 1, showscale: false};
  const hover = "%{" + (view.faces ? "intensity" : "marker.color") + ":.4~g}<extra></extra>";
  const placed = oriented(view, up);
  if (!view.faces) {
    return {type: "scatter3d", mode: "markers", ...placed, hovertemplate: hover, marker: {size: sizeOf(), color: value.data, opacity: 1, line: {width: 0}, ...shade}};
  }
  const count = view.faces.length / 3;
  const corner = (which) => Int32Array.from({length: count}, (_, face) => view.faces[3 * face + which]);
  return {type: "mesh3d", ...placed, i: corner(0), j: corner(1), k: corner(2), intensity: value.data, hovertemplate: hover, ...shade,
    lighting: {ambient: 0.65, diffuse: 0.6, specular: 0.05, roughness: 0.9}, lightposition: {x: 1000, y: -2000, z: 3000}, flatshading: false};
}

const chosen = () => document.querySelector("input[name=colour]:checked").value;
const upward = () => document.getElementById("up").value;
const sizeOf = () => Number(document.getElementById("size").value);

function showScale() {
  const colour = chosen(), {low, high} = payload.views[0].values[colour];
  const [title, note] = EXPLAINED[colour];
  document.getElementById("scale-title").textContent = title;
  document.getElementById("scale-note").textContent = note;
  document.getElementById("scale-low").textContent = short(low);
  document.getElementById("scale-middle").textContent = short((low + high) / 2);
  document.getElementById("scale-high").textContent = short(high);
}

function recolour() {
  const colour = chosen();
  showScale();
  return Promise.all(plots.map(({plot, view}) => {
    const {data, low, high} = view.values[colour];
    const top = high > low ? high : low + 1;
    return Plotly.restyle(plot, view.faces
      ? {intensity: [data], cmin: low, cmax: top}
      : {"marker.color": [data], "marker.cmin": low, "marker.cmax": top});
  }));
}

function reorient() {
  return Promise.all(plots.map(({plot, view}) => Plotly.react(plot, [traceOf(view, chosen(), upward())], layoutOf())));
}

function layoutOf() {
  return {scene: sceneOf(upward()), margin: {l: 0, r: 0, t: 0, b: 0}, paper_bgcolor: "#b9c0ca", font: FONT, showlegend: false};
}

// Plots that are being moved by this script: what they report is no wish of the reader's.
const busy = new Set();
function move(targets, update) {
  targets.forEach((plot) => busy.add(plot));
  return Promise.all(targets.map((plot) => Plotly.relayout(plot, {"scene.camera": update})))
    .finally(() => targets.forEach((plot) => busy.delete(plot)));
}

const isLinked = () => document.getElementById("linked").checked;
let latest = null, moving = false;
async function follow(source, update) {
  latest = [source, update];
  if (moving) return;
  moving = true;
  while (latest) {
    const [plot, wanted] = latest;
    latest = null;
    await new Promise(requestAnimationFrame);
    await move(plots.map((each) => each.plot).filter((each) => each !== plot), wanted);
  }
  moving = false;
}

function listen(plot) {
  const moved = (event, source) => {
    const update = event["scene.camera"];
    if (busy.has(plot) || !update) return;
    camera = polar(update.eye);
    if (isLinked()) follow(source, update);
  };
  plot.on("plotly_relayouting", (event) => moved(event, plot));
  // A slow machine may turn on a little after the last word: in the end all take what was said.
  plot.on("plotly_relayout", (event) => moved(event, null));
}

function point(only) {
  const update = {eye: eyeOf(camera), up: {x: 0, y: 0, z: 1}, center: {x: 0, y: 0, z: 0}};
  return move(plots.map(({plot}) => plot).filter((plot) => !only || isLinked() || plot === only), update);
}

function onKey(event) {
  const step = Math.PI / 24, highest = Math.PI / 2 - 0.01;
  const changes = {
    ArrowLeft: {turn: camera.turn - step}, ArrowRight: {turn: camera.turn + step},
    ArrowUp: {lift: Math.min(camera.lift + step, highest)}, ArrowDown: {lift: Math.max(camera.lift - step, -highest)},
    "+": {distance: camera.distance / 1.1}, "=": {distance: camera.distance / 1.1}, "-": {distance: camera.distance * 1.1},
    "0": {...START, distance: DISTANCE},
  };
  if (!(event.key in changes) || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  camera = {...camera, ...changes[event.key]};
  point(event.currentTarget);
}

function hasWebGL() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl") || canvas.getContext("experimental-webgl"));
}

async function start() {
  const colours = payload.colorscale.map(([place, colour]) => `${colour} ${100 * place}%`);
  document.getElementById("scale-bar").style.background = `linear-gradient(to right, ${colours.join(", ")})`;
  showScale();
  await drawHistograms(document.getElementById("histograms"), payload.histograms);
  if (!hasWebGL()) {
    document.getElementById("no-webgl").hidden = false;
    return;
  }
  const box = document.getElementById("views");
  if (payload.views.length === 2) box.classList.add("two");
  for (const spec of payload.views) {
    const view = {x: unpack(spec.x), y: unpack(spec.y), z: unpack(spec.z), faces: spec.faces && unpack(spec.faces), values: {}};
    for (const [name, {data, low, high}] of Object.entries(spec.values)) view.values[name] = {data: unpack(data), low, high};
    const {figure, plot, caption} = figureWithPlot(box, "", "plot");
    figure.className = "view";
    const title = document.createElement("strong");
    title.textContent = spec.title;
    caption.append(title, spec.note);
    plot.tabIndex = 0;
    plot.setAttribute("role", "application");
    plot.setAttribute("aria-label", `${spec.title}: ${spec.note}. Arrow keys turn the view, plus and minus change the distance, 0 resets it.`);
    plots.push({plot, view});
  }
  for (const {plot, view} of plots) {
    await Plotly.newPlot(plot, [traceOf(view, chosen(), upward())], layoutOf(), CONFIG);
    listen(plot);
    plot.addEventListener("keydown", onKey);
  }
  document.getElementById("controls").addEventListener("submit", (event) => event.preventDefault());
  document.querySelectorAll("input[name=colour]").forEach((input) => input.addEventListener("change", recolour));
  document.getElementById("up").addEventListener("change", reorient);
  document.getElementById("size").addEventListener("input", () => plots.filter(({view}) => !view.faces).forEach(({plot}) => Plotly.restyle(plot, {"marker.size": sizeOf()})));
  document.getElementById("linked").addEventListener("change", (event) => { if (event.target.checked) point(null); });
  document.getElementById("reset").addEventListener("click", () => { camera = {...START, distance: DISTANCE}; point(null); });
}

start().then(() => { document.body.dataset.ready = "yes"; });
