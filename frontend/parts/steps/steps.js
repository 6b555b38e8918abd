// Shows the places one at a time and turns the picture to each; reads them aloud with the browser's own voice on demand.
const words = JSON.parse(document.getElementById("steps-words").textContent);
const places = [...document.querySelectorAll("#places > [data-place]")];
const view = document.getElementById("view");
const now = document.getElementById("step-now");
const back = document.getElementById("step-back");
const next = document.getElementById("step-next");
const say = document.getElementById("say");
const calm = matchMedia("(prefers-reduced-motion: reduce)");
let step = 0; // 0: all of them

function turn() {
  const place = step ? places[step - 1].dataset.place : "all";
  view?.contentWindow.postMessage({ lubdub: "turn", place, calm: calm.matches }, "*");
}

function show() {
  quiet();
  places.forEach((place, index) => {
    place.hidden = step > 0 && index !== step - 1;
    if (index === step - 1) place.setAttribute("aria-current", "step");
    else place.removeAttribute("aria-current");
  });
  now.textContent = step ? places[step - 1].dataset.now : words.all;
  back.disabled = step === 0;
  next.textContent = step === 0 ? words.start : step === places.length ? words.end : words.next;
  turn();
}

function go(by) {
  step = (step + by + places.length + 1) % (places.length + 1);
  view?.scrollIntoView({ block: "nearest" });
  if (back.disabled === false && step === 0 && document.activeElement === back) next.focus();
  show();
}

function quiet() {
  if (!("speechSynthesis" in window)) return;
  speechSynthesis.cancel();
  heard();
}

function heard() {
  say.textContent = words.say;
  say.setAttribute("aria-pressed", "false");
}

function speak() {
  const shown = step ? [places[step - 1]] : places;
  const lines = shown.flatMap((place) => [...place.querySelectorAll("h3, p")].map((line) => line.textContent));
  const voice = new SpeechSynthesisUtterance(lines.join("\n"));
  voice.lang = document.documentElement.lang;
  voice.rate = 0.9;
  voice.onend = voice.onerror = heard;
  speechSynthesis.cancel();
  speechSynthesis.speak(voice);
  say.textContent = words.stop;
  say.setAttribute("aria-pressed", "true");
}

document.getElementById("stepper").hidden = false;
back.addEventListener("click", () => go(-1));
next.addEventListener("click", () => go(1));
document.getElementById("steps").addEventListener("keydown", (event) => {
  const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!by || event.altKey || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  if (step + by >= 0 && step + by <= places.length) go(by);
});
addEventListener("message", (event) => {
  if (event.source !== view?.contentWindow) return;
  if (event.data?.lubdub === "ready") turn();
  if (event.data?.lubdub === "turned") view.dataset.place = event.data.place;
});
if ("speechSynthesis" in window) {
  say.hidden = false;
  say.addEventListener("click", () => (say.getAttribute("aria-pressed") === "true" ? quiet() : speak()));
  addEventListener("pagehide", () => speechSynthesis.cancel());
}
show();
