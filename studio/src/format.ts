// Numbers, times and sizes as people read them.

/** A number with so many significant digits, without an exponent where it can be avoided. */
export function number(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e7 || size < 1e-4) return value.toExponential(digits - 1);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  const text = value.toFixed(Math.min(decimals, 12));
  return text.includes(".") ? text.replace(/0+$/, "").replace(/\.$/, "") : text;
}

/** Any value of the server as text; a number to four digits. */
export function shown(value: unknown): string {
  if (value === null || value === undefined) return "–";
  if (typeof value === "number") return number(value, 5);
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) return value.map(shown).join(", ");
  if (typeof value === "object") return JSON.stringify(value);
  return String(value);
}

export function bytes(count: number): string {
  if (count < 1000) return `${count} B`;
  if (count < 1e6) return `${number(count / 1e3, 3)} kB`;
  if (count < 1e9) return `${number(count / 1e6, 3)} MB`;
  return `${number(count / 1e9, 3)} GB`;
}

export function duration(seconds: number): string {
  if (seconds < 0.1) return `${number(seconds * 1000, 3)} ms`;
  if (seconds < 120) return `${number(seconds, 3)} s`;
  const whole = Math.round(seconds), minutes = Math.round(seconds / 60);
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** The stamp that is shown as zero: of a clock of dates the first, of any other its own zero. */
export const zeroOf = (first: number) => Number.isFinite(first) && first >= 1e8 ? first : 0;

/** A stamp of the log: as many decimals as the view needs. */
export function stamp(seconds: number, view: number): string {
  const decimals = Math.min(6, Math.max(0, Math.ceil(2.5 - Math.log10(Math.max(view, 1e-6)))));
  return seconds.toFixed(decimals);
}

export function date(value: number | string | null): string {
  if (value === null || value === "") return "";
  const when = new Date(typeof value === "number" ? value * 1000 : value);
  if (Number.isNaN(when.getTime())) return String(value);
  const two = (n: number) => String(n).padStart(2, "0");
  return `${when.getFullYear()}-${two(when.getMonth() + 1)}-${two(when.getDate())} ${two(when.getHours())}:${two(when.getMinutes())}`;
}

export const seconds = (value: number | string | null): number | null => {
  if (value === null) return null;
  const when = typeof value === "number" ? value : Date.parse(value) / 1000;
  return Number.isFinite(when) ? when : null;
};

export const plural = (count: number, one: string, many = one + "s") => `${count.toLocaleString("en")} ${count === 1 ? one : many}`;

/** A text with a capital first letter; the name of a file or of a measurement at its beginning stays as it is. */
export const capital = (text: string) => /^[\w-]+\.\w/.test(text) ? text : text.charAt(0).toUpperCase() + text.slice(1);
