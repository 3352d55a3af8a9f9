// What passes: the last seconds of residuals and pressure, drawn a few times a second.

import { color, onScheme } from "./colors.js";

const SPAN_S = 20;
const AGO_S = [20, 15, 10, 5, 0];
// Names of events that would lie on one another stand below one another, so far.
const NAME_ROWS = 3;

let charts = [];
let events = [];
let limit_ue = null, most_kpa = null;
// Time, residual of each finger, pressure, set-point.
let columns = [[], [], [], [], [], []];

export function setUp(residuals, pressures) {
  const finger = (n) => ({ label: `finger ${n}`, stroke: () => color(`--finger-${n}`), width: 1.6 });
  const pressure = [
    { label: "pressure", stroke: () => color("--accent"), width: 1.8 },
    { label: "set-point", stroke: () => color("--text"), width: 1.2, dash: [5, 4] },
  ];
  charts = [
    chart(residuals, [finger(1), finger(2), finger(3)], 48, (low, high) => [Math.min(low ?? 0, -800), Math.max(high ?? 0, 800)], shadeFree),
    chart(pressures, pressure, 48, (low, high) => [Math.min(low ?? 0, 0), Math.max(high ?? 0, most_kpa ?? 160) * 1.04], lineAtMost),
  ];
  onScheme(() => charts.forEach(({ plot }) => plot.redraw(false, true)));
}

function chart(element, series, axisSize, bounds, below) {
  const axis = { stroke: () => color("--dim"), grid: { stroke: () => color("--grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
  const plot = new uPlot({
    width: 300, height: 150,
    padding: [8, 10, 0, 0],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { show: false } },
    scales: { x: { time: false }, y: { range: (_, low, high) => pad(bounds(low, high)) } },
    axes: [
      { ...axis, size: 24, splits: (_, __, min, max) => AGO_S.map((ago) => max - ago), values: () => AGO_S.map((ago) => (ago ? `−${ago} s` : "now")) },
      { ...axis, size: axisSize, values: (_, marks) => marks.map((mark) => mark.toLocaleString("en").replace(/,/g, "\u202f")) },
    ],
    series: [{}, ...series.map((one) => ({ points: { show: false }, spanGaps: false, ...one }))],
    hooks: { drawAxes: [below], draw: [markEvents] },
  }, [[], ...series.map(() => [])], element);
  const made = { plot, element };
  fit(made);
  new ResizeObserver(() => fit(made)).observe(element);
  return made;
}

function pad([low, high]) {
  const room = (high - low) * 0.04;
  return [low - room, high + room];
}

function fit({ plot, element }) {
  const width = element.clientWidth, height = element.clientHeight;
  if (width > 0 && height > 0) plot.setSize({ width, height });
}

// Without contact a residual lies in here.
function shadeFree(plot) {
  if (!limit_ue) return;
  const { ctx, bbox } = plot;
  const top = plot.valToPos(limit_ue, "y", true), bottom = plot.valToPos(-limit_ue, "y", true);
  ctx.save();
  ctx.fillStyle = color("--band");
  ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
  ctx.restore();
}

function lineAtMost(plot) {
  if (!most_kpa) return;
  const { ctx, bbox } = plot;
  const y = plot.valToPos(most_kpa, "y", true);
  ctx.save();
  ctx.strokeStyle = color("--alarm");
  ctx.globalAlpha = 0.6;
  ctx.setLineDash([]);
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
}

function markEvents(plot) {
  const { ctx, bbox } = plot;
  const { min, max } = plot.scales.x;
  const row = 13 * devicePixelRatio, gap = 4 * devicePixelRatio;
  ctx.save();
  ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
  ctx.textAlign = "left";
  ctx.textBaseline = "top";
  ctx.setLineDash([]);
  ctx.lineWidth = devicePixelRatio;
  ctx.globalAlpha = 0.75;
  const taken = Array.from({ length: NAME_ROWS }, () => []);
  const seen = events.filter(({ t_s }) => t_s >= min && t_s <= max);
  // What matters most has its name first.
  seen.sort((a, b) => (b.level === "alarm") - (a.level === "alarm"));
  for (const { t_s, name, level } of seen) {
    const x = plot.valToPos(t_s, "x", true);
    ctx.strokeStyle = ctx.fillStyle = color(level === "alarm" ? "--alarm" : "--dim");
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    const words = name.replace(/_/g, " "), width = ctx.measureText(words).width;
    // Beside its line, on the side where there is room.
    const left = x + gap + width > bbox.left + bbox.width ? x - gap - width : x + gap;
    const right = left + width + gap;
    // Three fingers that touch at once are named once.
    if (taken.flat().some((other) => other.words === words && Math.abs(other.x - x) < row)) continue;
    const place = taken.findIndex((others) => others.every((other) => right < other.left || left > other.right));
    if (place < 0) continue;
    ctx.fillText(words, left, bbox.top + 2 + place * row);
    taken[place].push({ words, x, left, right });
  }
  ctx.restore();
}

export function add(samples) {
  // A clock that has gone back is that of a gripper that has restarted.
  if (samples.length && samples[0][0] < columns[0].at(-1)) clear();
  for (const sample of samples) sample.forEach((value, i) => columns[i].push(value));
  const times = columns[0], from_s = times.at(-1) - SPAN_S;
  let old = 0;
  while (times[old] < from_s) old += 1;
  if (old) for (const column of columns) column.splice(0, old);
}

export function setLimit(ue) {
  limit_ue = ue;
}

export function mark(event) {
  events.push(event);
  if (events.length > 100) events.shift();
}

export function setMost(kpa) {
  most_kpa = kpa;
}

export function clear() {
  columns = columns.map(() => []);
  events = [];
}

// Draws one of the charts, by its place.
export function draw(place) {
  const times = columns[0];
  if (!times.length) return;
  const end = times[times.length - 1];
  const [from, to] = [[1, 4], [4, 6]][place];
  const { plot } = charts[place];
  plot.batch(() => {
    plot.setData([times, ...columns.slice(from, to)], false);
    plot.setScale("x", { min: end - SPAN_S, max: end });
  });
}
