// The page: what comes is shown, what is clicked is sent.

import { command, connect } from "./link.js";
import * as fingers from "./fingers.js";
import * as charts from "./charts.js";
import * as settings from "./settings.js";
import * as calibrate from "./calibrate.js";

const get = (id) => document.getElementById(id);
const all = (selector) => document.querySelectorAll(selector);
const LINES = 200;

let hello = null, frame = null, standing = "no_token", live = false, ended = false;
let faults = {}, samples = 0, skipped = 0, lost_lines = 0, last_line = 0, frames = 0, turn = 0, counted = performance.now();
let noticed = "";

function text(id, value) {
  const place = typeof id === "string" ? get(id) : id;
  if (place.textContent !== value) place.textContent = value;
}

const number = (value, decimals) => (value === null || value === undefined ? "–" : value.toFixed(decimals));

const heard = {
  hello(body) {
    hello = body;
    frame = null;
    ended = false;
    chip();
    last_line = 0;
    turn = 0;
    faults = Object.fromEntries(body.faults.map((fault) => [fault.code, fault]));
    text("source", body.source);
    document.title = `softgrip: ${body.source}`;
    get("log").replaceChildren();
    get("world").hidden = !body.world;
    get("world").querySelector("select").replaceChildren(...body.world_faults.map((name) => new Option(name.replace(/-/g, " ").replace(/:/, ", finger "), name)));
    get("commands").hidden = !body.commands;
    fingers.describe(body.hand);
    charts.clear();
    charts.setMost(body.most_kpa);
    settings.describe(body);
    calibrate.describe(body);
    rows();
  },
  samples(body) {
    samples = body.length;
    frames += samples;
    charts.add(body);
  },
  // All of the last sample.
  frame(body) {
    if (frame) skipped += body.n - frame.n - samples;
    frame = body;
    charts.setLimit(body.limit_ue);
    calibrate.frame(body);
    notice();
    refresh();
  },
  log(body) {
    if (last_line && body.n > last_line + 1) lost_lines += body.n - last_line - 1;
    last_line = body.n;
    line(body);
    if (body.name) {
      charts.mark(body);
      calibrate.event(body);
    }
    if (body.ended) {
      ended = true;
      chip();
    }
  },
  settings(body) {
    settings.update(body);
    calibrate.settings(body);
    if (body.values[100] !== undefined) charts.setMost(body.values[100]);
  },
  saved({ saved }) {
    for (const place of all(".unsaved")) text(place, saved ? "" : "changed, and not saved");
  },
  standing(body) {
    standing = body.standing;
    allow();
  },
};

// What must be seen at once, in the frame that brings it: state, loss, faults.
function notice() {
  const { state, lost, fault, gauge_faults, tare_due } = frame;
  const now = JSON.stringify([state, lost, fault, gauge_faults, tare_due, ended]);
  if (now === noticed) return;
  noticed = now;
  const box = get("state");
  box.dataset.state = lost ? "lost" : state ?? "none";
  // When it was shown, by the clock that this page and the server may have in common.
  box.dataset.shownMs = Date.now();
  text("state_word", lost ? "lost" : state ?? "unknown");
  text("state_more", lost ? `${lost.words}; ${state ?? "state unknown"}` : "");
  alarms();
}

function alarms() {
  const found = [];
  if (frame.lost) found.push(alarm("lost", "The object is gone", frame.lost.words, "Acknowledge it; no grip is accepted before."));
  if (frame.fault) found.push(faultAlarm(frame.fault, "The gripper is in its safe state"));
  (frame.gauge_faults ?? []).forEach((code, i) => code && found.push(faultAlarm(code, `Finger ${i + 1}: its gauge has failed`)));
  if (frame.tare_due) found.push(alarm("due", "A tare is due", "A gauge's zero has moved, or something leans on a finger.", "Open the gripper, keep clear of the fingers, and tare."));
  get("alarms").replaceChildren(...found);
}

function faultAlarm(code, where) {
  const fault = faults[code];
  if (!fault) return alarm("fault", `Fault ${code}`, where, "This program does not know it: it is older than the gripper's.");
  return alarm("fault", `Fault ${code}: ${fault.name}`, `${where}: ${fault.cause}.`, `${fault.remedy}.`);
}

function alarm(kind, title, cause, remedy) {
  const box = document.createElement("div");
  box.className = `alarm ${kind}`;
  const [head, why, what] = ["b", "span", "span"].map((tag) => document.createElement(tag));
  head.textContent = title;
  why.textContent = cause;
  what.textContent = `What to do: ${remedy}`;
  what.className = "remedy";
  box.append(head, why, what);
  return box;
}

function line({ t_s, text: words, level, at_ms }) {
  const log = get("log");
  const item = document.createElement("li");
  const time = document.createElement("time");
  time.textContent = t_s === null || t_s === undefined ? "" : t_s.toFixed(3);
  const what = document.createElement("span");
  what.textContent = words;
  item.className = level;
  item.append(time, what);
  item.dataset.toldMs = at_ms;
  item.dataset.shownMs = Date.now();
  log.prepend(item);
  while (log.children.length > LINES) log.lastChild.remove();
  text("lost_lines", lost_lines ? `${lost_lines} lines lost` : "");
}

function rows() {
  const made = [0, 1, 2].map((i) => {
    const row = document.createElement("tr");
    row.innerHTML = "<th></th><td class=bar><svg viewBox='0 0 100 8' preserveAspectRatio='none'><rect class='free' height='8' width='0'/><rect class='seen' height='8' width='0'/></svg></td><td></td><td></td><td></td>";
    row.className = `finger-${i + 1}`;
    row.firstChild.textContent = i + 1;
    return row;
  });
  get("gauges").replaceChildren(...made);
}

function gauges() {
  const full = hello.full_strain_ue;
  [...get("gauges").children].forEach((row, i) => {
    const [free, seen] = row.querySelectorAll("rect");
    const width = (ue) => String(Math.max(0, Math.min(100, (100 * (ue ?? 0)) / full)).toFixed(1));
    const set = (bar, value) => bar.getAttribute("width") !== value && bar.setAttribute("width", value);
    set(free, width(frame.free_ue?.[i]));
    set(seen, width(frame.strain_ue[i]));
    const touches = frame.touching?.[i];
    if (row.classList.contains("touching") !== Boolean(touches)) row.classList.toggle("touching", Boolean(touches));
    const cells = row.cells;
    text(cells[2], number(frame.residual_ue[i], 0));
    text(cells[3], number(frame.noise_ue?.[i], 0));
    text(cells[4], number(frame.drift_ue?.[i], 0));
  });
}

// With the first frame all, and with each of the others, eight times a second, one half: to draw is what a page costs.
function refresh() {
  turn += 1;
  const now = performance.now();
  if (now - counted > 1000) {
    text("rate", ((1000 * frames) / (now - counted)).toFixed(0));
    text("clock", `${frame.t_s.toFixed(0)} s`);
    text("dropped", String(frame.dropped));
    text("skipped", String(skipped));
    frames = 0;
    counted = now;
  }
  if (document.hidden) return;
  if (!get("calibrate").hidden) calibrate.redraw();
  if (get("operate").hidden) return;
  fingers.draw(frame);
  charts.draw(turn % 2);
  if (turn === 1) charts.draw(0);
  else if (turn % 2) return;
  const percent = (share) => number(share === null ? null : 100 * share, 0);
  text("kpa", number(frame.kpa, 1));
  text("set_kpa", number(frame.set_kpa, 1));
  text("bend", number(frame.bend_deg, 1));
  text("level", percent(frame.level));
  text("margin", percent(frame.margin));
  gauges();
}

function chip() {
  const place = get("link");
  const state = !live ? "gone" : ended ? "ended" : "live";
  document.body.classList.toggle("stale", state !== "live");
  place.dataset.state = state;
  text(place, { gone: "no connection", ended: "source ended", live: "live" }[state]);
  allow();
}

const STANDINGS = {
  wrong_token: ["watching: the token is wrong", "The terminal prints the address of this run; a token is good for one run only."],
  no_token: ["watching", "Open the address with the token that the terminal prints to command."],
  another_commands: ["watching: another page commands", "It must be closed before this one can take over."],
  nobody_commands: ["watching: nobody commands", ""],
  commands: ["this page commands", ""],
};

function allow() {
  const [words, more] = STANDINGS[standing];
  const works = live && !ended && Boolean(hello?.commands);
  text("standing", hello && !hello.commands ? "this source takes no commands" : words);
  get("standing").title = more;
  get("standing").dataset.standing = standing;
  get("take_over").hidden = !works || standing !== "nobody_commands";
  get("stop").disabled = !works || !["commands", "another_commands", "nobody_commands"].includes(standing);
  const may = works && standing === "commands";
  for (const button of all("main button")) {
    if (button.id !== "apply" && button.id !== "discard") button.disabled = !may;
  }
  settings.allow(may);
}

// The problem of a command, beside what was clicked, and at its field.
function tell(part, answer) {
  const place = part.querySelector(".problem");
  if (!place) return;
  place.hidden = !answer.error;
  text(place, answer.error ?? "");
  for (const input of part.querySelectorAll("input")) {
    input.classList.toggle("wrong", Boolean(answer.error) && input.name === answer.field);
  }
}

function valuesOf(form) {
  const values = {};
  for (const input of form.elements) {
    if (!input.name) continue;
    if (input.type === "number") values[input.name] = input.value === "" ? null : Number(input.value);
    else values[input.name] = input.value;
  }
  return values;
}

async function act(from, name, values) {
  const part = from.closest(".card") ?? document.body;
  tell(part, await command(name, values));
}

function setUp() {
  fingers.setUp(get("hand"));
  charts.setUp(get("residuals"), get("pressures"));
  settings.setUp();
  for (const button of all("button[data-do]")) {
    button.addEventListener("click", () => {
      const name = button.dataset.do;
      const arm = ["lift", "carry", "lower"].includes(name);
      act(button, name, arm ? valuesOf(get("world").querySelector("form")) : {});
    });
  }
  for (const form of all("form")) {
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      if (form.dataset.do) act(form, form.dataset.do, valuesOf(form));
    });
  }
  get("stop").addEventListener("click", () => command("stop"));
  get("take_over").addEventListener("click", () => command("take_over"));
  for (const button of all("#views button")) {
    button.addEventListener("click", () => {
      for (const other of all("#views button")) {
        other.classList.toggle("chosen", other === button);
        get(other.dataset.view).hidden = other !== button;
      }
    });
  }
  allow();
  connect(heard, (state) => {
    live = state === "live";
    if (!live) standing = "no_token";
    chip();
  });
}

setUp();
