// Turns the picture to one place, or back to the whole chest, when the page around it asks.
// One place at a time: the marks of the others are hidden meanwhile.
(() => {
  const views = JSON.parse(document.getElementById("lubdub-views").textContent);
  const TURN_MS = 400;
  let running = 0;

  const camera = () => viserInside()?.mutable.current.cameraControl;

  // viser turns its whole world so that its up is three.js' up: places are turned along.
  function turned(place) {
    const [w, x, y, z] = viserInside().useSceneTree.get("").wxyz;
    const across = (a) => [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]];
    const twice = across(place).map((value, axis) => value + w * place[axis]);
    return across(twice).map((value, axis) => place[axis] + 2 * value);
  }

  function here(control) {
    const target = control.getTarget();
    const eye = control.getPosition();
    return { eye: [eye.x, eye.y, eye.z], target: [target.x, target.y, target.z] };
  }

  function stand(control, { eye, target }) {
    control.setPosition(...eye, false);
    control.setTarget(...target, false);
    document.documentElement.dataset.eye = eye.map((value) => value.toFixed(4)).join(" ");
  }

  const between = (a, b, share) => a.map((value, axis) => value + share * (b[axis] - value));
  const length = (a) => Math.hypot(...a);
  const less = (a, b) => a.map((value, axis) => value - b[axis]);

  // The eye keeps its distance on the way, so that the picture turns and does not dive into the body.
  function along(from, to, share) {
    const target = between(from.target, to.target, share);
    const arms = [less(from.eye, from.target), less(to.eye, to.target)];
    const arm = between(arms[0], arms[1], share);
    const reach = length(arms[0]) + share * (length(arms[1]) - length(arms[0]));
    const stretch = reach / (length(arm) || 1);
    return { target, eye: target.map((value, axis) => value + arm[axis] * stretch) };
  }

  function alone(name) {
    for (const place of Object.keys(views)) {
      const overrideVisibility = name === "all" || name === place;
      if (place !== "all") viserInside().sceneTreeActions.updateNodeAttributes(`/areas/${place}`, { overrideVisibility });
    }
  }

  function turn(name, calm) {
    const control = camera();
    if (!control || !views[name]) return;
    alone(name);
    const to = { eye: turned(views[name].eye), target: turned(views[name].target) };
    const from = here(control);
    const started = performance.now();
    const mine = ++running;
    const step = (moment) => {
      if (mine !== running) return;
      const share = calm ? 1 : Math.min(1, (moment - started) / TURN_MS);
      stand(control, along(from, to, share * share * (3 - 2 * share)));
      if (share < 1) requestAnimationFrame(step);
      else tell({ lubdub: "turned", place: name, milliseconds: performance.now() - started });
    };
    step(started);
  }

  const tell = (what) => window.parent.postMessage(what, "*");

  addEventListener("message", (event) => {
    if (event.source === window.parent && event.data?.lubdub === "turn") turn(event.data.place, event.data.calm);
  });
  for (const kind of ["pointerdown", "wheel", "keydown"]) addEventListener(kind, () => (running += 1), true);
  const looking = setInterval(() => {
    if (!camera()) return;
    clearInterval(looking);
    tell({ lubdub: "ready" });
  }, 100);
})();
