const MARKS = {
  mean: {name: "mean", color: BLUE, symbol: "circle", dash: "solid"},
  rms: {name: "RMS", color: "#00664d", symbol: "square", dash: "dash"},
  max: {name: "max", color: ORANGE, symbol: "diamond", dash: "dot"},
};
const curve = document.getElementById("curve");
curve.setAttribute("role", "img");
curve.setAttribute("aria-label", "Mean, RMS and largest error against the number of points that stay; the table below has the figures");
const traces = Object.entries(payload.curves).map(([key, values]) => ({
  type: "scatter", mode: "lines+markers", name: MARKS[key].name, x: payload.points, y: values,
  line: {color: MARKS[key].color, dash: MARKS[key].dash, width: 2},
  marker: {color: MARKS[key].color, symbol: MARKS[key].symbol, size: 9},
  hovertemplate: "%{x} points: %{y:.2e}<extra>" + MARKS[key].name + "</extra>",
}));
if (payload.floor) {
  const ends = [Math.min(...payload.points), Math.max(...payload.points)];
  traces.push({type: "scatter", mode: "lines", name: "floor, mean", x: ends, y: [payload.floor, payload.floor], line: {color: SOFT, dash: "longdash", width: 1.5}, hovertemplate: "%{y:.2e}<extra>floor, mean</extra>"});
}
const axis = {type: "log", gridcolor: LINE, exponentformat: "e", fixedrange: true};
Plotly.newPlot(curve, traces, {
  font: FONT, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
  margin: {l: 75, r: 15, t: 30, b: 50},
  legend: {orientation: "h", x: 1, xanchor: "right", y: 1.02, yanchor: "bottom"},
  xaxis: {...axis, title: {text: "points that stay"}, tickvals: payload.points, ticktext: payload.points.map(String), minor: {}},
  yaxis: {...axis, title: {text: "error, share of the diagonal"}, dtick: 1},
}, CONFIG).then(() => { document.body.dataset.ready = "yes"; });
