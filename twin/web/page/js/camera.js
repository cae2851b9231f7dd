/** A camera: as motion JPEG from the server of the page, or, where that has none, as compressed images by rosbridge. */

import { html, useEffect, useRef, useState } from "ui";

const COMPRESSED = "sensor_msgs/msg/CompressedImage", IMAGE = "sensor_msgs/msg/Image";
const PERIOD_MS = 200;

/** Topics of cameras, compressed ones first: their pictures are passed on as they are. */
function camerasOf(types) {
  const of = (type) => [...types.keys()].filter((topic) => types.get(topic) === type && !/depth/i.test(topic)).sort();
  const compressed = of(COMPRESSED);
  return [...compressed, ...of(IMAGE).filter((topic) => !compressed.includes(`${topic}/compressed`))];
}

function useVisible() {
  const [visible, setVisible] = useState(!document.hidden);
  useEffect(() => {
    const look = () => setVisible(!document.hidden);
    document.addEventListener("visibilitychange", look);
    return () => document.removeEventListener("visibilitychange", look);
  }, []);
  return visible;
}

/** The pictures of one topic, asked for only while they are seen: a camera that nobody looks at need not draw. */
function Picture({ station, topic }) {
  const image = useRef(), [streams, setStreams] = useState(true), visible = useVisible();
  useEffect(() => {
    if (!visible) return undefined;
    if (streams) {
      image.current.src = station.address("stream", { topic });
      return () => (image.current.src = "");
    }
    return station.ros.subscribe(topic, COMPRESSED, ({ format, data }) => {
      if (image.current) image.current.src = `data:image/${/png/.test(format) ? "png" : "jpeg"};base64,${data}`;
    }, PERIOD_MS);
  }, [topic, visible, streams]);
  const fail = () => visible && streams && station.types.get(topic) === COMPRESSED && setStreams(false);
  return html`<figure><img ref=${image} class="camera" alt=${topic} data-by=${streams ? "stream" : "topic"} onError=${fail} /><figcaption class="muted">${topic}</figcaption></figure>`;
}

export function Camera({ station, t }) {
  const cameras = camerasOf(station.types), [chosen, setChosen] = useState("");
  const topic = cameras.includes(chosen) ? chosen : cameras[0];
  if (!topic) return html`<p class="muted">${t("noCamera")}</p>`;
  return html`${cameras.length > 1 && html`<label class="small">${t("camera")}<select value=${topic} onChange=${(event) => setChosen(event.target.value)}>
    ${cameras.map((each) => html`<option value=${each}>${each}</option>`)}</select></label>`}
    <${Picture} key=${`${topic} ${station.ros.connected}`} station=${station} topic=${topic} />`;
}
