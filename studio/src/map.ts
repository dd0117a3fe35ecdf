// The map under the track, by MapLibre: a file of its own, loaded only where a map is shown.
// Tiles come from the server of this page; style, fonts and icons are none but these lines.

import { LngLatBounds, Map as MapView, Marker, NavigationControl, ScaleControl, setWorkerUrl } from "maplibre-gl";
import "maplibre-gl/dist/maplibre-gl.css";
import type { Line, MapHandle, PlanProps } from "./plan";
import type { MapInfo } from "./types";

setWorkerUrl(new URL("./map-worker.js", import.meta.url).href);

/** Parts of a line between its pauses. */
const partsOf = (line: Line) => line.t.reduce<number[][][]>((parts, _, i) => {
  const at = [line.lon[i]!, line.lat[i]!];
  if (at.every(Number.isFinite)) parts[parts.length - 1]!.push(at);
  else if (parts[parts.length - 1]!.length) parts.push([]);
  return parts;
}, [[]]);

const feature = (line: Line, points: boolean) => ({
  type: "Feature" as const, properties: {},
  geometry: points ? { type: "MultiPoint" as const, coordinates: partsOf(line).flat() } : { type: "MultiLineString" as const, coordinates: partsOf(line).filter((part) => part.length > 1) },
});

/** Draw the map into `place`; an error is thrown where the browser cannot. */
export function drawMap(place: HTMLElement, info: MapInfo, props: PlanProps): MapHandle {
  const css = getComputedStyle(document.documentElement);
  const color = (name: string) => css.getPropertyValue(name).trim();
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const map = new MapView({
    container: place, attributionControl: { compact: true }, fadeDuration: 0,
    style: {
      version: 8,
      sources: { tiles: { type: "raster", tiles: [new URL(info.tiles!, document.baseURI).href.replaceAll("%7B", "{").replaceAll("%7D", "}")], tileSize: 256, minzoom: info.min, maxzoom: info.max, attribution: "" } },
      layers: [
        { id: "ground", type: "background", paint: { "background-color": color("--tint") } },
        { id: "tiles", type: "raster", source: "tiles" },
      ],
    },
  });
  map.addControl(new NavigationControl({ showCompass: false }));
  map.addControl(new ScaleControl({}));
  const bounds = new LngLatBounds();
  for (const line of [props.track, props.fixes, props.reference]) {
    line?.t.forEach((_, i) => { if (Number.isFinite(line.lon[i]) && Number.isFinite(line.lat[i])) bounds.extend([line.lon[i]!, line.lat[i]!]); });
  }
  map.fitBounds(bounds, { padding: 40, animate: false, maxZoom: info.max + 2 });
  map.on("load", () => {
    const add = (id: string, line: Line | null | undefined, name: string, points: boolean) => {
      if (!line || !line.t.length) return;
      map.addSource(id, { type: "geojson", data: feature(line, points) });
      if (points) map.addLayer({ id, type: "circle", source: id, paint: { "circle-radius": 3, "circle-color": color(name) } });
      else map.addLayer({ id, type: "line", source: id, paint: { "line-width": 3, "line-color": color(name) } });
    };
    add("fixes", props.fixes, "--trace2", true);
    add("reference", props.reference, "--trace3", false);
    add("track", props.track, "--trace1", false);
  });
  const line = props.track ?? props.fixes;
  const dot = new Marker({ color: color("--mark"), scale: 0.7 });
  if (line) {
    map.on("mousemove", (event) => {
      let best = Infinity, at = -1;
      line.t.forEach((_, i) => {
        const far = (line.lat[i]! - event.lngLat.lat) ** 2 + (line.lon[i]! - event.lngLat.lng) ** 2;
        if (far < best) { best = far; at = i; }
      });
      if (at >= 0 && map.project([line.lon[at]!, line.lat[at]!]).dist(event.point) < 40) props.onCursor(line.t[at]!);
    });
  }
  const words = document.createElement("p");
  words.className = "attribution";
  words.textContent = info.attribution ?? "";
  place.append(words);
  return {
    cursor: (t) => {
      if (t === null || !line || !line.t.length) { dot.remove(); return; }
      let i = line.t.findIndex((one) => one >= t);
      if (i < 0) i = line.t.length - 1;
      if (!Number.isFinite(line.lat[i]!) || !Number.isFinite(line.lon[i]!)) { dot.remove(); return; }
      dot.setLngLat([line.lon[i]!, line.lat[i]!]).addTo(map);
      if (!map.getBounds().contains([line.lon[i]!, line.lat[i]!])) map.panTo([line.lon[i]!, line.lat[i]!], { animate: !still });
    },
    remove: () => map.remove(),
  };
}
