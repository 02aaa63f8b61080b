// One cursor through all charts of a joint, and the log played in its own time.
(() => {
"use strict";
const {sysid} = window, {at, number} = sysid.page;
const {plot} = sysid.workspace;
let cursor = null, due = false, film = null;
const held = () => sysid.drawn.held;

function moved(t) {
  cursor = t;
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    pointed();
  });
}

function stepped(by, [a, b]) { // by hundredths of what is in sight
  moved(Math.min(b, Math.max(a, (cursor === null ? a : cursor) + by * (b - a) / 100)));
}

function nearest(times, t) {
  let low = 0, high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] < t) low = middle;
    else high = middle;
  }
  return Math.abs(times[low] - t) <= Math.abs(times[high] - t) ? low : high;
}

function placed() { // the line over time
  const layout = plot("time")._fullLayout;
  if (!layout || cursor === null) return;
  const line = at("workspace-cursor"), axis = layout.xaxis, x = axis._offset + axis.l2p(cursor);
  line.hidden = x < axis._offset - 1 || x > axis._offset + axis._length + 1;
  line.style.left = plot("time").offsetLeft + x + "px";
  line.style.top = plot("time").offsetTop + layout._size.t + "px";
  line.style.height = layout._size.h + "px";
}

function pointed() {
  const {cloud, frames} = held();
  if (!cloud || !cloud.t.length || cursor === null) return;
  placed();
  const k = nearest(cloud.t, cursor), dots = name => plot(name).data ? plot(name).data[0] : null;
  const p = dots("position"), s = dots("speed");
  if (!p || !s) return;
  Plotly.restyle(plot("position"), {x: [[p.x[k]]], y: [[p.y[k]]]}, [1]);
  Plotly.restyle(plot("speed"), {x: [[s.x[k]]], y: [[s.y[k]]]}, [1]);
  if (plot("map").data) Plotly.restyle(plot("map"), {x: [[p.x[k]]], y: [[s.x[k]]]}, [1]);
  if (frames && plot("robot").data) {
    const f = nearest(frames.t, cursor);
    const [x, y, z] = frames.links[f], [u, v, w] = frames.joints[f];
    Plotly.restyle(plot("robot"), {x: [x, u], y: [y, v], z: [z, w]}, [0, 1]);
  }
  const [unit, each] = cloud.unit === "N" ? [" m, ", " m/s"] : [" rad, ", " rad/s"];
  at("workspace-clock").textContent = cursor.toFixed(3) + " s: residual " + number(p.y[k]) + " "
    + cloud.unit + " at " + number(p.x[k]) + unit + number(s.x[k]) + each;
}

function play() { // and again from the start of what is in sight
  const button = at("workspace-play");
  const stop = () => {
    clearInterval(film);
    film = null;
    button.setAttribute("aria-pressed", "false");
    button.textContent = "play";
  };
  if (film !== null) {
    stop();
    return;
  }
  if (!held().whole) return;
  button.setAttribute("aria-pressed", "true");
  button.textContent = "pause";
  let last = performance.now();
  film = setInterval(() => {
    if (!button.isConnected) {
      stop();
      return;
    }
    const now = performance.now(), [a, b] = sysid.drawn.inSight();
    const next = (cursor === null ? a : cursor) + (now - last) / 1000;
    last = now;
    moved(next > b || next < a ? a : next);
  }, 60);
}

sysid.cursor = {
  moved, stepped, placed, play, at: () => cursor,
  anew: () => { if (sysid.drawn) held().frames = null; },
  forget: () => {
    cursor = null;
    sysid.brush.forget();
  },
};
})();
