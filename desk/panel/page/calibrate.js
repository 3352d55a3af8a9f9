// The guided sweep: what the controller expected of the free fingers before, what the sweep measures, and what it
// expects afterwards.

import { color, onScheme } from "./colors.js";
import { field } from "./settings.js";

const LEARNED = [110, 202, 220, 221, 222, 230, 231, 232, 240, 241, 242, 250, 251, 252];
// A step rests when the pressure has been at the set-point for so long.
const RESTING_S = 0.3;

const get = (id) => document.getElementById(id);

let plot = null, shape = null;
let now = null, before = null, sweeping = false, began_s = 0;
let measured = [], rests_since_s = 0, last_set = null;
let rejections = {};

export function describe(hello) {
  rejections = Object.fromEntries(hello.sweep_rejections.map((row) => [row.name, row]));
  shape = hello.curve_kpa;
  if (!plot) setUp(get("curves"));
  draw();
}

function setUp(element) {
  const axis = { stroke: () => color("--dim"), grid: { stroke: () => color("--grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
  const series = [1, 2, 3].flatMap((n) => [
    { stroke: () => color(`--finger-${n}`), width: 1.2, dash: [5, 4], points: { show: false } },
    { stroke: () => color(`--finger-${n}`), width: 1.8, points: { show: false } },
  ]);
  plot = new uPlot({
    width: 400, height: 300, padding: [8, 12, 0, 0],
    legend: { show: false }, cursor: { show: false },
    scales: { x: { time: false }, y: {} },
    axes: [{ ...axis, size: 26 }, { ...axis, size: 56, values: (_, marks) => marks.map((mark) => mark.toLocaleString("en").replace(/,/g, "\u202f")) }],
    series: [{}, ...series],
    hooks: { draw: [dots] },
  }, [[], ...series.map(() => [])], element);
  const fit = () => element.clientWidth && plot.setSize({ width: element.clientWidth, height: element.clientHeight });
  new ResizeObserver(fit).observe(element);
  onScheme(() => plot.redraw(false, true));
}

function dots(plot) {
  const { ctx } = plot;
  ctx.save();
  for (const { kpa, strain_ue } of measured) {
    strain_ue.forEach((ue, i) => {
      if (ue === null) return;
      ctx.beginPath();
      ctx.arc(plot.valToPos(kpa, "x", true), plot.valToPos(ue, "y", true), 2.6 * devicePixelRatio, 0, 2 * Math.PI);
      ctx.fillStyle = color(`--finger-${i + 1}`);
      ctx.fill();
    });
  }
  ctx.restore();
}

function draw() {
  if (!plot || !shape) return;
  const none = shape.map(() => null);
  const data = [0, 1, 2].flatMap((i) => [before?.curves_ue[i] ?? none, now?.curves_ue[i] ?? none]);
  plot.setData([shape, ...data]);
}

export function settings(body) {
  now = body;
  draw();
  compare();
}

function compare() {
  const rows = LEARNED.map((number) => {
    const one = field(number), old = before?.values[number], value = now?.values[number];
    if (!one || value === undefined) return null;
    const row = document.createElement("tr");
    if (old !== undefined && old !== value) row.className = "changed";
    for (const text of [one.name, old === undefined ? "–" : short(old), short(value), one.unit]) {
      row.insertCell().textContent = text;
    }
    return row;
  });
  get("learned").replaceChildren(...rows.filter(Boolean));
}

const short = (value) => String(Number(value.toPrecision(4)));

export function frame(body) {
  ready(body);
  const runs = body.state === "sweeping";
  if (runs && !sweeping) {
    before = now;
    measured = [];
    began_s = body.t_s;
    compare();
  }
  sweeping = runs;
  if (!runs) return;
  say(`running for ${(body.t_s - began_s).toFixed(0)} s, at ${body.kpa?.toFixed(1) ?? "–"} kPa`, "busy");
  const rests = body.set_kpa === last_set && Math.abs(body.kpa - body.set_kpa) < 1;
  if (!rests) rests_since_s = body.t_s;
  last_set = body.set_kpa;
  if (body.t_s - rests_since_s < RESTING_S) return;
  // The last one of a step is the one that has rested longest.
  if (measured.at(-1)?.set_kpa === body.set_kpa) measured.pop();
  measured.push({ set_kpa: body.set_kpa, kpa: body.kpa, strain_ue: body.strain_ue });
}

export function redraw() {
  if (sweeping) plot?.redraw(false, false);
}

export function event({ name, text }) {
  if (name === "swept") say(text, "good");
  if (name === "tared") get("tare_result").textContent = text;
  if (name !== "refused") return;
  if (text.includes("TareRejected")) get("tare_result").textContent = text;
  const sweep = text.match(/SweepRejected\((\w+)\)/);
  if (sweep) {
    const why = rejections[sweep[1]];
    say(why ? `${text}: ${why.cause}. What to do: ${why.remedy}.` : text, "bad");
  }
}

function say(text, kind = "") {
  const place = get("sweep_result");
  place.textContent = text;
  place.className = kind;
}

function ready(body) {
  const points = [
    ["the gripper is idle", body.state === "idle"],
    ["no fault is latched", !body.fault],
    ["no loss is latched", !body.lost],
    ["no gauge has failed", !(body.gauge_faults ?? []).some(Boolean)],
  ];
  const shown = points.map(([text, good]) => `${good}:${text}`).join();
  const list = get("ready");
  if (list.dataset.shown === shown) return;
  list.dataset.shown = shown;
  list.replaceChildren(...points.map(([text, good]) => {
    const item = document.createElement("li");
    item.textContent = text;
    item.className = good ? "good" : "bad";
    return item;
  }));
}
