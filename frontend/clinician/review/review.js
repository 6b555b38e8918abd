// The review page, and the page on which a reference body is marked: buttons answer without a reload, the stream says
// when things went on elsewhere or the picture was lost, and the arrow keys move the area in hand along the skin. All
// words come from the server.
import { follow } from "/static/lib/link.js";
import { connection, cut } from "/static/lib/lost_view.js";

const review = document.getElementById("review");
const panel = document.getElementById("panel");
const scale = document.getElementById("scale");
const told = document.getElementById("told");
const base = review.dataset.base;
const asJson = { headers: { Accept: "application/json" } };

const STEP_MM = 2;
const LONG_STEP_MM = 10;
const STEPS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

let current = "";
let isLeaving = false; // a decision ends the review: the answer says where to go on, the stream then has no say
let version = Number(panel.querySelector("[name=version]").value);

function focusedName() {
  const one = document.activeElement;
  if (!panel.contains(one)) return null;
  if (one.dataset.landmark) return `[data-landmark="${one.dataset.landmark}"]`;
  if (one.dataset.area) return `[data-area="${one.dataset.area}"]`;
  return one.id ? `#${one.id}` : "#main-button";
}

function swap(now) {
  if (now.next) return window.location.assign(now.next);
  const focused = focusedName();
  panel.innerHTML = now.panel;
  version = now.version;
  if (focused) (panel.querySelector(`${focused}:not([disabled])`) ?? panel.querySelector("#main-button"))?.focus({ preventScroll: true });
  const state = panel.querySelector(`[data-area="${current}"] .areas__words`);
  told.textContent = state ? state.textContent.replace(/\s+/g, " ").trim() : "";
}

function complain(words) {
  const place = document.getElementById("told-error");
  place.textContent = words;
  place.hidden = false;
}

async function refresh() {
  const answer = await fetch(`${base}/panel?current=${current}`, asJson);
  if (answer.ok) swap(await answer.json());
  else window.location.reload();
}

async function act(fields) {
  const said = new FormData(document.getElementById("acts"));
  for (const [name, value] of Object.entries({ window: review.dataset.window, ...fields })) said.set(name, value);
  if (fields.area) current = fields.area;
  else said.set("area", current);
  isLeaving = !["look", "move", "undo"].includes(fields.action ?? "look");
  const answer = await fetch(`${base}/review`, { method: "POST", body: said, ...asJson });
  const now = await answer.json();
  if (answer.ok) return swap(now);
  isLeaving = false;
  await refresh().catch(() => {});
  complain(now.detail);
}

function failed() {
  isLeaving = false;
  complain(review.dataset.failed);
}

document.addEventListener("submit", (event) => {
  const form = event.target;
  if (form.id === "tools") {
    event.preventDefault();
    dress(form, event.submitter).catch(failed);
  } else if (form.closest("#panel")) {
    event.preventDefault();
    const fields = Object.fromEntries(new FormData(form, event.submitter));
    delete fields.version;
    if (form.id !== "acts" && !["look", "move"].includes(fields.action)) delete fields.area;
    act(fields).catch(failed);
  }
});

async function dress(form, button) {
  await fetch(form.action, { method: "POST", body: new FormData(form, button) });
  if (button.name === "layer") {
    for (const one of form.querySelectorAll("[name=layer]")) one.setAttribute("aria-pressed", String(one === button));
    scale.hidden = button.value !== "misfit";
  } else if (button.name !== "whole") {
    const isOn = button.value === "yes";
    button.setAttribute("aria-pressed", String(isOn));
    button.value = isOn ? "no" : "yes";
  }
}

// Presses while an answer is on its way are added up and sent together.
let left = 0;
let up = 0;
let isMoving = false;

async function move(what) {
  isMoving = true;
  try {
    while (left !== 0 || up !== 0) {
      const fields = { action: "move", ...what, left_mm: left, up_mm: up };
      left = 0;
      up = 0;
      await act(fields);
    }
  } finally {
    isMoving = false;
  }
}

panel.addEventListener("keydown", (event) => {
  const step = STEPS[event.key];
  const isTyping = event.target.closest("select, textarea");
  const { area = current, landmark } = event.target.dataset;
  if (!step || isTyping || !(area || landmark) || !document.getElementById("main-button")) return;
  event.preventDefault();
  const far = event.shiftKey ? LONG_STEP_MM : STEP_MM;
  left += step[0] * far;
  up += step[1] * far;
  if (!isMoving) move(landmark ? { landmark } : { area }).catch(failed);
});

let status = null;

function heard(now) {
  if (isLeaving) return;
  if (status !== null && now.status !== status) return window.location.reload();
  status = now.status;
  connection(now.connected);
  if (now.version !== version && !isMoving) refresh().catch(() => {});
}

follow(`${base}/live?window=${review.dataset.window}`, { heard, lost: cut });
