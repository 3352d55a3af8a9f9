// The settings: the table of all of them, checked field by field before anything is sent.

import { command } from "./link.js";

const get = (id) => document.getElementById(id);
let fields = new Map(), rows = new Map(), values = {}, may = false;

export const field = (number) => fields.get(number);

// A value as it is shown: a word, or the shortest number that is the same in 32 bits.
export function inUnit(one, value) {
  if (one.words) return one.words[value] ?? String(value);
  return String(Number(Math.fround(value).toPrecision(7)));
}

export function describe(hello) {
  fields = new Map(hello.fields.map((one) => [one.number, one]));
  rows = new Map();
  const groups = new Map();
  for (const one of hello.fields) {
    const group = one.name.split(".")[0];
    if (!groups.has(group)) groups.set(group, []);
    groups.get(group).push(one);
  }
  get("fields").replaceChildren(...[...groups].map(([group, members]) => {
    const part = document.createElement("fieldset");
    const title = document.createElement("legend");
    title.textContent = group.replace(/_/g, " ");
    part.append(title, ...members.map(row));
    return part;
  }));
}

function row(one) {
  const line = document.createElement("label");
  line.className = "field";
  const name = document.createElement("span");
  name.className = "name";
  name.textContent = one.name.slice(one.name.indexOf(".") + 1);
  const input = one.words ? choice(one.words) : number(one);
  input.name = one.name;
  input.dataset.number = one.number;
  input.disabled = true;
  const unit = document.createElement("span");
  unit.className = "unit";
  unit.textContent = one.unit;
  const about = document.createElement("span");
  about.className = "about";
  about.textContent = one.words ? one.sentence : `${one.sentence} (${inUnit(one, one.min)} to ${inUnit(one, one.max)})`;
  const error = document.createElement("span");
  error.className = "error";
  error.setAttribute("role", "alert");
  line.append(name, input, unit, about, error);
  input.addEventListener("input", () => check(one));
  rows.set(one.number, { line, input, error });
  return line;
}

function choice(words) {
  const select = document.createElement("select");
  words.forEach((word, i) => select.add(new Option(word, i)));
  return select;
}

function number(one) {
  const input = document.createElement("input");
  input.type = "text";
  input.inputMode = "decimal";
  input.autocomplete = "off";
  input.size = 9;
  return input;
}

// The number in a field, or what is wrong with it.
function read(one) {
  const { input } = rows.get(one.number);
  const text = input.value.trim();
  const value = Number(text);
  if (!text || !Number.isFinite(value)) return { error: "must be a number" };
  if (value < one.min || value > one.max) return { error: `must lie within ${inUnit(one, one.min)} and ${inUnit(one, one.max)} ${one.unit}`.trim() };
  if (one.whole && !Number.isInteger(value)) return { error: "must be a whole number" };
  return { value: Math.fround(value) };
}

function isChanged(one) {
  const known = values[one.number];
  return known !== undefined && rows.get(one.number).input.value.trim() !== shown(one, known);
}

const shown = (one, value) => (one.words ? String(value) : inUnit(one, value));

function check(one) {
  const { line, error } = rows.get(one.number);
  const changed = isChanged(one);
  line.classList.toggle("changed", changed);
  error.textContent = (changed && read(one).error) || "";
  buttons();
}

function buttons() {
  const changed = [...fields.values()].filter(isChanged);
  get("apply").disabled = !may || !changed.length || changed.some((one) => read(one).error);
  get("discard").disabled = !changed.length;
}

export function update(body) {
  for (const one of fields.values()) {
    const { input, line } = rows.get(one.number);
    const was = values[one.number], is = body.values[one.number];
    line.classList.toggle("unknown", is === undefined);
    if (is === undefined) continue;
    // What somebody is changing stays as it is.
    const untouched = was === undefined || input.value.trim() === shown(one, was);
    if (untouched) input.value = shown(one, is);
  }
  values = body.values;
  for (const one of fields.values()) if (values[one.number] !== undefined) check(one);
  allow(may);
}

export function allow(allowed) {
  may = allowed;
  for (const [number, { input }] of rows) input.disabled = !may || values[number] === undefined;
  buttons();
}

export function setUp() {
  get("settings_form").addEventListener("submit", async (event) => {
    event.preventDefault();
    if (get("apply").disabled) return;
    for (const one of [...fields.values()].filter(isChanged)) {
      const { value } = read(one);
      const answer = await command("set", { number: one.number, value });
      rows.get(one.number).error.textContent = answer.error ?? "";
    }
    buttons();
  });
  get("discard").addEventListener("click", () => {
    for (const one of fields.values()) {
      if (values[one.number] === undefined) continue;
      rows.get(one.number).input.value = shown(one, values[one.number]);
      check(one);
    }
  });
}
