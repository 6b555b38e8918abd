// What every page needs: nhsuk-frontend's behaviours for skip link, error summary, radios and double clicks.
import { initAll } from "/static/nhsuk.js";

document.body.classList.add("js-enabled");
if ("noModule" in HTMLScriptElement.prototype) document.body.classList.add("nhsuk-frontend-supported");
initAll();
