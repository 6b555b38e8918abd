// Shows the stage as it changes and moves on when the work has ended. It listens to the stream; while that is broken,
// and now and then in case it is silent, it asks.
const live = document.getElementById("live");
const stage = document.getElementById("stage");
const left = document.getElementById("left");
const fraction = document.getElementById("fraction");
const offline = document.getElementById("offline");
const ASK_MS = 3000;
const STILL_THERE_MS = 10000;
let isAsking = false;
let askedAt = 0;

function show(state) {
  if (state.next !== window.location.pathname) {
    window.location.replace(state.next);
    return;
  }
  if (stage.textContent !== state.stage) stage.textContent = state.stage;
  if (left.textContent !== state.left) left.textContent = state.left;
  fraction.value = state.fraction;
}

async function ask() {
  if (isAsking) return;
  isAsking = true;
  askedAt = Date.now();
  try {
    const answer = await fetch(live.dataset.state, { headers: { Accept: "application/json" } });
    if (answer.status === 404) window.location.reload(); // deleted in another window
    else if (answer.ok) show(await answer.json());
    offline.hidden = answer.ok;
  } catch {
    offline.hidden = false;
  } finally {
    isAsking = false;
  }
}

const stream = new EventSource(live.dataset.events);
for (const kind of ["status", "progress"]) stream.addEventListener(kind, ask);
setInterval(() => {
  const pause = stream.readyState === EventSource.OPEN ? STILL_THERE_MS : ASK_MS;
  if (Date.now() - askedAt >= pause) ask();
}, 1000);
addEventListener("pageshow", ask);
addEventListener("online", ask);
