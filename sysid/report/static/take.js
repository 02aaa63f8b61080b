// Charts taken along: PNG, SVG and CSV, each under a name that says what it is.
(() => {
"use strict";
const {sysid} = window;
const KINDS = ["PNG", "SVG", "CSV"];
const letters = text => String(text).replaceAll("&lt;", "<").replaceAll("&gt;", ">")
  .replaceAll("&amp;", "&"); // Plotly is given names as markup

function saved(name, address) {
  const link = document.createElement("a");
  Object.assign(link, {href: address, download: name});
  link.click();
}

// ---- a picture: as it is drawn on paper, dark or light, of what is in sight
async function picture(place, format) {
  const plot = place.querySelector(".plot"), chart = sysid.chartOf(place);
  const before = sysid.printing;
  sysid.printing = true;
  const {data, layout} = sysid.dressed(chart);
  sysid.printing = before;
  data.forEach((trace, k) => { if (plot.data[k]) trace.visible = plot.data[k].visible; });
  for (const [key, axis] of Object.entries(plot._fullLayout)) {
    if (/^[xy]axis\d*$/.test(key) && layout[key]) layout[key].range = [...axis.range];
  }
  if (layout.scene) layout.scene.camera = structuredClone(plot._fullLayout.scene.camera);
  Object.assign(layout, {paper_bgcolor: "#ffffff", autosize: false});
  const size = {width: plot.offsetWidth, height: plot.offsetHeight};
  return Plotly.toImage({data, layout}, {format, ...size, scale: format === "png" ? 2 : 1});
}

// ---- the numbers that are drawn
function quoted(value) {
  const text = value === null || value === undefined ? "" : letters(value);
  return /[",\n\r]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
}

function rowsOf(chart) {
  const {data, layout} = chart.figure;
  const title = (axis, usual) => layout[axis] && layout[axis].title ? layout[axis].title.text
    : usual;
  const [first] = data, x = title("xaxis", "x"), y = title("yaxis", "y");
  if (first && first.type === "heatmap") {
    const bar = first.colorbar && first.colorbar.title ? first.colorbar.title.text : "value";
    return [[x, y, bar, "rows"], ...first.y.flatMap((v, r) => first.x.map((u, c) => [u, v,
      first.z[r][c], first.customdata ? first.customdata[r][c] : ""]))];
  }
  const spatial = data.some(trace => trace.z), heads = ["", x, y];
  const own = trace => trace.yaxis ? title("yaxis" + trace.yaxis.slice(1), y) : y;
  const all = data.filter(trace => trace.x && trace.hoverinfo !== "skip").flatMap(trace =>
    trace.x.map((u, k) => spatial ? [trace.name, u, trace.y[k], trace.z[k]]
      : [trace.name || own(trace), u, trace.y[k], own(trace)]));
  return [spatial ? ["", "x [m]", "y [m]", "z [m]"] : [...heads, "quantity"], ...all];
}

function csv(chart) {
  const text = rowsOf(chart).map(row => row.map(quoted).join(",")).join("\n") + "\n";
  return URL.createObjectURL(new Blob([text], {type: "text/csv"}));
}

async function take(place, kind, name, rows) {
  const chart = sysid.chartOf(place), ending = "." + kind.toLowerCase();
  const file = name.replace(/[^\w.-]+/g, "_") + ending;
  if (kind === "CSV" && rows) saved(file, rows()); // the server has every row
  else if (kind === "CSV" && chart) saved(file, csv(chart));
  else if (chart) saved(file, await picture(place, kind.toLowerCase()));
}

// the buttons of a chart; name: () => of its files; rows: () => where a server has its rows
sysid.taken = (place, name, rows = null) => {
  const box = document.createElement("figcaption"), label = place.getAttribute("aria-label");
  box.className = "take";
  for (const kind of KINDS) {
    const button = document.createElement("button");
    Object.assign(button, {type: "button", textContent: kind});
    button.dataset.take = kind;
    button.setAttribute("aria-label", "save " + label + " as " + kind);
    button.addEventListener("click", () => take(place, kind, name(), rows));
    box.append(button);
  }
  return box;
};
})();
