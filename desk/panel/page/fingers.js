// The hand, drawn as its gauges say that it is bent: three chains of links around the gripper's axis, seen a little
// from above. Dashed behind each: how far it would bend freely.

import { color, onScheme } from "./colors.js";

const TURN = [Math.PI * 7 / 6, Math.PI * 11 / 6, Math.PI / 2]; // finger 3 stands behind
const TILT = 0.30;
// A tip that has turned by less is drawn where it was.
const REST_DEG = 0.5;
const FROM_MM = -24, TO_MM = 114, WIDTH_MM = 108;

let canvas, context, hand, last = {};

export function setUp(element) {
  canvas = element;
  context = canvas.getContext("2d");
  const again = () => { last = {}; };
  new ResizeObserver(again).observe(canvas);
  onScheme(again);
}

// What is the same in every frame: lengths of the links, radius of the palm, thickness.
export function describe(description) {
  hand = description;
  last = {};
}

// Points of a chain in its own plane, from the clamp on: distance from the axis, depth below the palm.
function chain(links_deg) {
  let r = hand.palm_mm, z = 0;
  const points = [[r, z]];
  links_deg.forEach((deg, i) => {
    const angle = deg * Math.PI / 180;
    r -= hand.links_mm[i] * Math.sin(angle);
    z += hand.links_mm[i] * Math.cos(angle);
    points.push([r, z]);
  });
  return points;
}

export function draw(frame) {
  if (!hand || !frame || !canvas.clientWidth) return;
  // Noise moves nothing.
  const marks = JSON.stringify([Boolean(frame.object), frame.touching, frame.gauge_faults]);
  const tips = [...frame.links_deg, frame.free_deg].map((links) => links?.at(-1) ?? null);
  const rests = tips.every((tip, i) => (tip === null ? last.tips?.[i] === null : Math.abs(tip - last.tips?.[i]) < REST_DEG));
  if (rests && marks === last.marks) return;
  last = { tips, marks };
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const scale = Math.min(width / WIDTH_MM, height / (TO_MM - FROM_MM));
  const top = (height - scale * (TO_MM - FROM_MM)) / 2 - scale * FROM_MM;
  // A point at a distance from the axis, in the direction of a finger, and its depth.
  const at = ([r, z], turn) => [width / 2 + scale * r * Math.cos(turn), top + scale * (z * Math.cos(TILT) - r * Math.sin(turn) * Math.sin(TILT))];

  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.lineCap = context.lineJoin = "round";

  if (frame.free_deg) {
    const free = chain(frame.free_deg);
    for (const turn of TURN) stroke(free.map((p) => at(p, turn)), color("--faint"), 1.5, [4, 4]);
  }
  finger(frame, 2, at, scale);
  if (frame.object) ball(frame.object, at, scale);
  palm(at, scale);
  finger(frame, 0, at, scale);
  finger(frame, 1, at, scale);
  context.textAlign = "center";
  context.fillStyle = color("--text");
  context.font = "600 13px system-ui, sans-serif";
  TURN.forEach((turn, i) => {
    const [x, y] = at([hand.palm_mm * 0.74, -5], turn);
    context.fillText(String(i + 1), x, y + 5);
  });
  if (frame.object) {
    context.fillStyle = color("--dim");
    context.font = "12px system-ui, sans-serif";
    context.fillText(`object, as the gauges tell: room for ⌀ ${(2 * frame.object.radius_mm).toFixed(0)} mm`, width / 2, height - 8);
  }
}

function stroke(points, ink, width, dash = []) {
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.setLineDash(dash);
  context.strokeStyle = ink;
  context.lineWidth = width;
  context.stroke();
  context.setLineDash([]);
}

function finger(frame, which, at, scale) {
  const turn = TURN[which], ink = color(`--finger-${which + 1}`);
  const thick = 2 * hand.radius_mm * scale;
  const links = frame.links_deg[which];
  const base = at([hand.palm_mm, 0], turn);
  if (links) {
    const points = chain(links).map((p) => at(p, turn));
    stroke(points, color("--edge"), thick + 2);
    stroke(points, ink, thick);
    // The bright side, and the joints.
    stroke(points.map(([x, y]) => [x - thick * 0.16, y]), "rgba(255,255,255,.22)", thick * 0.3);
    for (const [x, y] of points.slice(1, -1)) dot(x, y, Math.max(1.2, thick * 0.09), "rgba(0,0,0,.28)");
    const [x, y] = points[points.length - 1];
    if (frame.touching?.[which]) ring(x, y, thick * 0.85, ink);
  } else {
    stroke([base, at([hand.palm_mm, 100], turn)], color("--faint"), 2, [2, 6]);
  }
  if (frame.gauge_faults?.[which]) ring(base[0], base[1] + thick, thick * 0.8, color("--alarm"));
}

function palm(at, scale) {
  const [x, y] = at([0, -5], 0);
  const r = (hand.palm_mm + hand.radius_mm + 3) * scale;
  context.beginPath();
  context.ellipse(x, y, r, r * Math.sin(TILT), 0, 0, 2 * Math.PI);
  context.fillStyle = color("--palm");
  context.globalAlpha = 0.82;
  context.fill();
  context.globalAlpha = 1;
  context.strokeStyle = color("--edge");
  context.lineWidth = 1.5;
  context.stroke();
}

function ball({ radius_mm, depth_mm }, at, scale) {
  const [x, y] = at([0, depth_mm], 0);
  const r = radius_mm * scale;
  const light = context.createRadialGradient(x - r * 0.35, y - r * 0.4, r * 0.1, x, y, r);
  light.addColorStop(0, "rgba(255,255,255,.55)");
  light.addColorStop(0.35, "rgba(255,255,255,0)");
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  context.globalAlpha = 0.8;
  context.fillStyle = color("--object");
  context.fill();
  context.globalAlpha = 1;
  context.fillStyle = light;
  context.fill();
  context.setLineDash([5, 4]);
  context.strokeStyle = color("--edge");
  context.lineWidth = 1;
  context.stroke();
  context.setLineDash([]);
}

function dot(x, y, r, ink) {
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  context.fillStyle = ink;
  context.fill();
}

function ring(x, y, r, ink) {
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  context.strokeStyle = ink;
  context.lineWidth = 2;
  context.stroke();
}
