// viser draws a thick yellow edge around whatever can be pressed and lies under the pointer. On a body that is a stain.
setInterval(() => {
  viserInside()?.mutable.current.scene?.traverse((one) => {
    if (one.material?.uniforms?.screenspace) one.visible = false;
  });
}, 500);
