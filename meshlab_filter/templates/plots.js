"use strict";
const payload = JSON.parse(document.getElementById("payload").textContent);
// Blue and orange of Okabe and Ito, told apart by every kind of colour vision.
const BLUE = "#0072B2", ORANGE = "#D55E00", SOFT = "#566072", LINE = "#d5dae2";
const FONT = {family: "system-ui, sans-serif", size: 13, color: "#1c2430"};
const CONFIG = {displayModeBar: false, responsive: true};

function unpack(spec) {
  const bytes = Uint8Array.from(atob(spec.data), (letter) => letter.charCodeAt(0));
  return spec.kind === "i4" ? new Int32Array(bytes.buffer) : new Float32Array(bytes.buffer);
}

function short(value) {
  if (Number.isInteger(value) || Math.abs(value) >= 1000) return String(Math.round(value));
  return Math.abs(value) < 0.01 ? value.toExponential(1) : value.toPrecision(3);
}

function figureWithPlot(parent, title, kind) {
  const figure = document.createElement("figure");
  const plot = document.createElement("div");
  const caption = document.createElement("figcaption");
  plot.className = kind;
  caption.textContent = title;
  figure.append(...(kind === "histogram" ? [caption, plot] : [plot, caption]));
  parent.append(figure);
  return {figure, plot, caption};
}

function drawHistogram(plot, spec) {
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", `${spec.title}: ${spec.y} against ${spec.x}`);
  const styles = [
    {fill: "rgba(0, 114, 178, 0.55)", line: BLUE, dash: "solid"},
    {fill: "rgba(213, 94, 0, 0.0)", line: ORANGE, dash: "dot"},
  ];
  if (spec.stack) styles[1].fill = "rgba(213, 94, 0, 0.75)";
  const traces = spec.series.map((series, index) => ({
    type: "bar",
    name: series.name,
    x: series.counts.map((_, bin) => (series.edges[bin] + series.edges[bin + 1]) / 2),
    width: series.counts.map((_, bin) => series.edges[bin + 1] - series.edges[bin]),
    y: series.counts,
    marker: {
      color: styles[index].fill,
      line: {color: styles[index].line, width: spec.stack ? 0.5 : 1.5},
      pattern: {shape: spec.stack && index === 1 ? "/" : "", fillmode: "overlay", fgcolor: "#ffffff", size: 6, solidity: 0.3},
    },
    hovertemplate: "%{x:.3~g}: %{y:.4~g}<extra>" + series.name + "</extra>",
  }));
  const layout = {
    barmode: spec.stack ? "stack" : "overlay",
    bargap: 0,
    font: FONT,
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    margin: {l: 60, r: 12, t: 30, b: 45},
    legend: {orientation: "h", x: 1, xanchor: "right", y: 1.02, yanchor: "bottom"},
    showlegend: true,
    xaxis: {title: {text: spec.x}, gridcolor: LINE, zerolinecolor: LINE, fixedrange: true, exponentformat: "e"},
    yaxis: {
      title: {text: spec.y}, gridcolor: LINE, zerolinecolor: LINE, fixedrange: true,
      type: spec.log ? "log" : "linear", exponentformat: "e",
      ...(spec.log ? {dtick: 1} : {}),
    },
  };
  if (spec.mark !== null) {
    layout.shapes = [{type: "line", xref: "x", yref: "paper", x0: spec.mark, x1: spec.mark, y0: 0, y1: 1, line: {color: SOFT, width: 1.5, dash: "dash"}}];
    layout.annotations = [{xref: "x", yref: "paper", x: spec.mark, y: 1, text: spec.label, showarrow: false, xanchor: "right", xshift: -4, yanchor: "top", font: {color: SOFT, size: 12}}];
  }
  return Plotly.newPlot(plot, traces, layout, CONFIG);
}

async function drawHistograms(parent, specs) {
  // All places first: a plot takes the width that its place has when it is drawn.
  const places = specs.map((spec) => figureWithPlot(parent, spec.title, "histogram").plot);
  for (const [index, spec] of specs.entries()) await drawHistogram(places[index], spec);
}
