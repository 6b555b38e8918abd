// Shows the stage as it changes and moves on when the work has ended; asks every 3 seconds where no stream comes.
const live = document.getElementById("live");
const stage = document.getElementById("stage");
const fraction = document.getElementById("fraction");

function show(state) {
  if (state.next !== window.location.pathname) {
    window.location.assign(state.next);
    return;
  }
  if (stage.textContent !== state.stage) stage.textContent = state.stage;
  fraction.value = state.fraction;
}

async function ask() {
  const answer = await fetch(live.dataset.state, { headers: { Accept: "application/json" } });
  if (answer.ok) show(await answer.json());
}

const stream = new EventSource(live.dataset.events);
for (const kind of ["status", "progress"]) stream.addEventListener(kind, () => ask().catch(() => {}));
setInterval(() => ask().catch(() => {}), 3000);
