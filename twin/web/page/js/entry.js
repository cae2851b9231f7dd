/** Who comes in: a token, if the server asks for one, and a name that others see. */

import { html, useEffect, useRef } from "ui";

/** Take what a form's only field holds. */
const taken = (event) => {
  event.preventDefault();
  return event.target.elements[0].value.trim();
};

/** In place of the map while the server lets nobody in. */
export function TokenForm({ station, t, enter }) {
  const { ros } = station;
  return html`<form class="card entry" id="token-form" onSubmit=${(event) => enter(taken(event))}>
    <h2>${t("tokenAsked")}</h2>
    ${ros.wrong && ros.wrong === ros.token && html`<p class="bad" role="alert">${t("tokenWrong")}</p>`}
    <label class="small">${t("token")}<input type="password" name="token" autocomplete="off" required /></label>
    <p class="muted">${t("tokenNote")}</p>
    <button class="primary">${t("enter")}</button></form>`;
}

/** A dialog for the operator's name; open while `shown`. */
export function NameDialog({ station, t, shown, close, rename }) {
  const dialog = useRef();
  useEffect(() => {
    if (shown) dialog.current.showModal();
  }, [shown]);
  const send = (event) => {
    rename(taken(event));
    dialog.current.close();
  };
  return html`<dialog ref=${dialog} aria-labelledby="name-title" onClose=${close}>
    ${shown && html`<h2 id="name-title">${t("who")}</h2><form class="entry" id="name-form" onSubmit=${send}>
      <label class="small">${t("name")}<input name="name" autocomplete="nickname" maxlength="80" defaultValue=${station.control.name} /></label>
      <p class="muted">${t("nameNote")}</p>
      <div class="row end"><button type="button" onClick=${() => dialog.current.close()}>${t("cancel")}</button><button class="primary">${t("keep")}</button></div></form>`}</dialog>`;
}

/** What was refused just now, told once; it goes by itself, or when it is read. */
export function Notice({ station, t }) {
  const { notice } = station;
  return notice && html`<div class="notice" role="alert" key=${notice.key}><span class="grow">${notice.words(t)}</span>
    <button class="icon" aria-label=${t("close")} onClick=${() => station.dismiss()}>✕</button></div>`;
}
