// viser 1.1.1 has no door to its camera and scene, so they are looked up where React keeps them; browser tests watch over it.
const viserInside = (() => {
  let inside = null;

  function viewer() {
    if (inside) return inside;
    const root = document.getElementById("root");
    const key = root && Object.keys(root).find((name) => name.startsWith("__reactContainer$"));
    const waiting = key ? [root[key].stateNode.current] : [];
    while (waiting.length) {
      const fiber = waiting.pop();
      const found = fiber.memoizedProps?.value;
      if (found?.useSceneTree && "cameraControl" in (found.mutable?.current ?? {})) return (inside = found);
      if (fiber.sibling) waiting.push(fiber.sibling);
      if (fiber.child) waiting.push(fiber.child);
    }
    return null;
  }

  return viewer;
})();
