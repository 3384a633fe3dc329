// Requests to the server that this page came from. The key is kept here, in memory alone.

/** A request that was refused: the problem document, or what stands for it where no answer came. */
export class Problem extends Error {
  constructor(status, reason, detail, retryAfter) {
    super(detail);
    this.status = status;
    this.reason = reason;
    this.retryAfter = retryAfter;
  }
}

export const LOST = 0;

let key = "";

/** Shows this key from now on; an empty one is none. */
export function useKey(secret) {
  key = secret.trim();
}

/** The path of a map, or of something of it. Names are quoted, whatever they are. */
export function pathOf(map, ...rest) {
  return ["v1", "maps", map, ...rest].map(encodeURIComponent).join("/");
}

/** The answer to a request; a refusal is thrown. Paths are relative, so that a proxy may put a prefix before them. */
export async function ask(path, { query, headers, ...options } = {}) {
  const said = query ? `?${new URLSearchParams(query)}` : "";
  const authorization = key ? { authorization: `Bearer ${key}` } : {};
  let response;
  try {
    response = await fetch(path + said, { cache: "no-store", ...options, headers: { ...authorization, ...headers } });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Problem(LOST, "no_answer", "The server cannot be reached.", 2);
  }
  if (response.ok) return response;
  const problem = await response.json().catch(() => ({}));
  const retryAfter = Number(response.headers.get("retry-after")) || undefined;
  const detail = problem.detail ?? `The server answered ${response.status}.`;
  throw new Problem(response.status, problem.reason ?? "", detail, retryAfter);
}

export async function read(path, query, options) {
  return (await ask(path, { query, ...options })).json();
}

export async function send(method, path, body) {
  const headers = { "content-type": "application/json" };
  const response = await ask(path, { method, headers, body: JSON.stringify(body) });
  return response.status === 204 ? undefined : response.json();
}

/** Blocks of voxels of one level in a box given in cells, and the revision that they are of, with the hash of the map then. */
export async function readBlocks(map, level, resolution, box, signal) {
  const query = { level };
  if (box) {
    // Cells are taken by their centers: half a cell within the border is none's center.
    query.min = box.min.map((cell) => cell * resolution).join(",");
    query.max = box.max.map((cell) => (cell - 0.25) * resolution).join(",");
  }
  const headers = { accept: "application/octet-stream" };
  const response = await ask(pathOf(map, "block"), { query, headers, signal });
  const revision = Number(response.headers.get("mrol-revision"));
  const [uuid, hash] = ["mrol-map-uuid", "mrol-content-hash"].map((name) => response.headers.get(name));
  return { revision, uuid, hash, bytes: new Uint8Array(await response.arrayBuffer()) };
}

/** A name for a change, by which sending it again changes nothing. */
export function requestId() {
  return `viewer-${Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("")}`;
}
