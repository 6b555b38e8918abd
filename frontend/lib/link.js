// The server's stream of changes, kept alive: opened again with growing pauses after a drop, at once when the network
// or the page comes back, and when it falls silent without saying so (a phone that slept).
const SILENCE_MS = 12000;
const LOOK_MS = 3000;
const PAUSES_MS = [500, 1000, 2000, 4000, 8000, 15000];

export function pause(tries) {
  return PAUSES_MS[Math.min(tries, PAUSES_MS.length - 1)];
}

export function follow(address, { heard, lost }) {
  let stream = null;
  let last = 0;
  let tries = 0;
  let again = null;

  function open() {
    clearTimeout(again);
    stream?.close();
    last = Date.now();
    stream = new EventSource(address);
    stream.addEventListener("marks", (event) => {
      last = Date.now();
      tries = 0;
      heard(JSON.parse(event.data));
    });
    stream.addEventListener("over", () => window.location.reload()); // nobody is signed in here any more
    stream.addEventListener("error", drop);
  }

  function drop() {
    stream?.close();
    stream = null;
    clearTimeout(again);
    again = setTimeout(open, pause(tries));
    tries += 1;
    lost();
  }

  function comeBack() {
    if (stream === null) open();
  }

  setInterval(() => {
    if (stream !== null && Date.now() - last > SILENCE_MS) drop();
  }, LOOK_MS);
  window.addEventListener("offline", drop);
  window.addEventListener("online", comeBack);
  window.addEventListener("pageshow", comeBack);
  document.addEventListener("visibilitychange", () => {
    if (document.visibilityState === "visible") comeBack();
  });
  open();
}
