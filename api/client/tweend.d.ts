// Types of tweend.js, the client of tweend.

/** A model's id, its description, or its entry in the list. */
export type ModelId = string | { id: string };
/** The content of an upload. Several files (a glTF and the files that it names) are stored as one GLB. */
export type ModelSource = string | Blob | ArrayBuffer | ArrayBufferView<ArrayBuffer> | readonly File[];

/** Points of a mesh that moved: which they are in the order of `points()`, and x y z of each in the mesh's space. */
export interface MovedPoints {
  indices: Iterable<number>;
  positions: Iterable<number>;
}
export type SurfaceForm = 'glb' | 'gltf' | 'obj' | 'json' | 'stl' | 'ply' | '3mf' | 'bin';
export type PoseForm = 'json' | 'ndjson' | 'bin' | 'csv';

/** Options of requests. */
export interface Abortable {
  signal?: AbortSignal;
  /** In place of the client's `retries`. */
  retries?: number;
  /** Called when the daemon puts off, with the seconds until it is asked again, and why. */
  onWait?(seconds: number, error: TweendError): void;
}

export interface UploadOptions extends Abortable {
  /** The model's name; default: the file's name. */
  name?: string;
  /** Media type; default: detected from the bytes. */
  type?: string;
  /** Called with the bytes sent so far and in all; in browsers not if the client was created with a `fetch`. */
  onProgress?(sent: number, total: number): void;
}

/** An error answer. Without an answer, `fetch`'s own error is thrown. */
export class TweendError extends Error {
  /**
   * The HTTP status. 401: a key is asked for. 403: the key lacks the right; or, without keys, pages of this origin may not do
   * that. 421: a daemon on a loopback address does not serve the host of `base`. `message` says what would help.
   */
  readonly status: number;
  readonly title?: string;
  readonly detail?: string;
  /** Mistakes in the document that was sent, with JSON pointers. */
  readonly errors: readonly { pointer: string; detail: string }[];
  /** The line in the OBJ that was sent, from 1. */
  readonly line?: number;
  readonly requestId?: string;
  /** Seconds to wait before a retry, which the client's own retries did not wait for any more. */
  readonly retryAfter?: number;
  /** The whole problem document. */
  readonly problem: Partial<Problem>;
}

export class Tweend {
  /**
   * base: URL of the daemon, including a path prefix. Default: the daemon that served this module; throws if none did, as in
   * a bundle or from npm. If another server answers there, requests reject with a TypeError that says so.
   */
  constructor(base?: string | URL, options?: { key?: string; fetch?: typeof fetch; retries?: number });
  /** Ends with a slash. */
  readonly base: string;
  /** An API key, sent with each request. */
  key?: string;

  /**
   * How often the daemon is asked again where it puts off (429, 503; for GET also 408, 502, 504), default 3: after `Retry-After`,
   * of which over 30 s are not waited for, else after 0.25 s and twice as long each time. All that it does may be asked twice.
   */
  retries: number;

  /** Fetches a path below `base`, or a URL. Throws a TweendError for an error answer. */
  request(path: string, init?: RequestInit & Pick<Abortable, "retries" | "onWait">): Promise<Response>;
  /** The URL of a path below `base`. */
  url(path: string): string;
  /** Signs the URL of a GET, so that it needs no key for `seconds`. If this client has no key, returns the absolute URL unsigned. */
  sign(url: string, seconds?: number): Promise<string>;

  upload(source: ModelSource, options?: UploadOptions): Promise<Model>;
  describe(model: ModelId, init?: Abortable): Promise<Model>;
  /** Makes a new model by editing a mesh of this one. `mesh` may be left out if the model has one mesh. */
  edit(model: ModelId, edits: Edit[], options?: { mesh?: string; name?: string } & Pick<SurfaceOptions, "quads"> & Abortable): Promise<Model>;
  /**
   * Makes a new model whose surface at `level` has these points of a mesh: x y z each, in the mesh's space and in the order of
   * `points()`; or those that moved, with their indices.
   */
  sculpt(model: ModelId, points: Iterable<number> | MovedPoints, options: { level: number; mesh?: string; name?: string } & Pick<SurfaceOptions, "quads"> & Abortable): Promise<Model>;
  /** Makes a new model by replacing a refined mesh by its cage; what the cage's surface lacks becomes detail. */
  coarsen(
    model: ModelId,
    options?: { mesh?: string; levels?: number | "max"; name?: string } & Pick<SurfaceOptions, "scheme" | "boundary" | "quads"> & Abortable,
  ): Promise<Model>;
  /**
   * Stores a clip that is mixed of others for this model's skeleton, and resolves with its name, which `clip` takes wherever
   * this model is asked: `{model id}/mix`. A layer's `clip` is one of this model, or `{model id}/NAME`, with `retarget: 'auto'`
   * if that model's skeleton is another.
   */
  mix(model: ModelId, layers: readonly Layer[], options?: { name?: string } & Abortable): Promise<string>;
  /** All models, by id, fetched page by page; `limit`: models per page. */
  list(options?: ListOptions & Abortable): AsyncGenerator<Listed, void, undefined>;
  remove(model: ModelId, init?: Abortable): Promise<void>;
  sourceUrl(model: ModelId, options?: SourceOptions): string;

  surfaceUrl(model: ModelId, options?: SurfaceOptions, form?: SurfaceForm): string;
  surface(model: ModelId, options?: SurfaceOptions, form?: SurfaceForm, init?: Abortable): Promise<Response>;
  /** The surface of a file that is not stored. */
  surfaceOf(source: ModelSource, options?: SurfaceOptions, form?: SurfaceForm, init?: Abortable): Promise<Response>;
  /** The points of a mesh of a surface in its own space, x y z each, and behind them what `with` asks for. `mesh` may be left out if the model has one mesh. */
  points(model: ModelId, options?: SurfaceOptions, init?: Abortable): Promise<Float32Array>;
  /** Counts, bytes and errors of all levels; the last one may be over a limit. */
  levels(model: ModelId, options?: Omit<SurfaceOptions, "level" | "error" | "faces">, init?: Abortable): Promise<Levels["levels"]>;
  surfaceCounts(model: ModelId, options?: SurfaceOptions, init?: Abortable): Promise<SurfaceCounts>;

  poseUrl(model: ModelId, options?: PoseOptions, form?: PoseForm): string;
  pose(model: ModelId, options?: PoseOptions, init?: Abortable): Promise<Poses>;
  /** Binary poses, row by row as they arrive. */
  poseStream(model: ModelId, options?: PoseOptions, init?: Abortable): Promise<PoseStream>;
  /** Binary poses, all at once. */
  poseTable(model: ModelId, options?: PoseOptions, init?: Abortable): Promise<PoseTable>;
  tracks(model: ModelId, options?: TracksOptions, init?: Abortable): Promise<Tracks>;
  rotations(request: RotationsRequest, init?: Abortable): Promise<Rotations>;

  /** Fetches a whole clip and returns a player of it. Players move nodes, and the morph targets of their meshes. */
  play(model: ModelId, objects: Objects, options?: PlayOptions): Promise<Player>;
  liveUrl(model: ModelId, options?: LiveOptions): string;
  /**
   * Returns a player of the live stream when the first frame has arrived. Until the clip ends, `close()` is called or
   * the signal aborts, it takes one of the six connections that a browser has to an origin over HTTP/1; a warning on
   * the console tells of the fourth. `play` takes none.
   */
  live(model: ModelId, objects: Objects, options?: LivePlayOptions): Promise<LivePlayer>;
}

// ---- poses in binary ----

export interface PoseHeader {
  clip: string | null;
  /** Seconds. */
  duration: number;
  space: 'local' | 'world';
  as: 'trs' | 'matrix' | 'euler' | 'axis-angle';
  order?: string;
  unit?: string;
  warnings?: string[];
  nodes: string[];
  skins?: { name: string | null; first: number; count: number }[];
  times: number[];
  /** Number of rows, one for each time. */
  poses: number;
  /** Floats of a row; `node_stride`: of a node in it. */
  stride: number;
  node_stride: number;
  layout: { name: PosePart; offset: number; byte_offset: number; components: number }[];
  /** Of the numbers of a row behind its nodes': the morph weights that the clip moves. `name` as in JSON; `node`: index in `nodes`. */
  weights?: { name: string; node: number; offset: number; byte_offset: number; components: number }[];
  /** With `root_motion`: of a row's last numbers. */
  root?: { name: 'rotation' | 'translation'; offset: number; byte_offset: number; components: number }[];
}

export type PosePart = 'rotation' | 'translation' | 'scale' | 'matrix' | 'euler' | 'axis_angle';

/** Can be read once, either row by row or whole. */
export class PoseStream implements AsyncIterable<Float32Array> {
  readonly header: PoseHeader;
  /** Yields rows as views. Leaving the loop cancels the request. */
  [Symbol.asyncIterator](): AsyncGenerator<Float32Array, void, undefined>;
  table(): Promise<PoseTable>;
}

export class PoseTable {
  readonly header: PoseHeader;
  /** [header.poses][header.stride]. */
  readonly rows: Float32Array;
  /** The row of a pose, as a view. */
  row(pose: number): Float32Array;
  /** A node's rotation, translation … in a row, as a view. node: its name, or its index in header.nodes. */
  part(pose: number, node: string | number, name: PosePart): Float32Array;
  /** A node's morph weights in a row, as a view; undefined where the clip moves none of its. node: as of `part`. */
  weights(pose: number, node: string | number): Float32Array | undefined;
  /** What `root_motion` took out of a pose, as a view. */
  root(pose: number, name: 'rotation' | 'translation'): Float32Array;
}

// ---- players ----

/** A vector of three.js or Babylon.js, anything with x, y and z, or a list. */
export type Vector = { x: number; y: number; z: number } | number[] | Float32Array | Float64Array;
/** A quaternion: the same, with w. */
export type Quaternion = { x: number; y: number; z: number; w: number } | number[] | Float32Array | Float64Array;

/** An object that a player moves: an Object3D of three.js, a node of Babylon.js, or similar. */
export type Movable = { position: Vector } & (
  | { quaternion: Quaternion; scale: Vector }
  | { rotationQuaternion: Quaternion | null; scaling: Vector }
);

/** Morph weights as `weights` of a Pose. */
export type MorphWeights = Record<string, number[]>;

/** Where a player finds objects by the names of nodes: a tree of three.js; a node, scene or container of Babylon.js; a list;
 * an object with a member for each name; or a function. Nodes without an object are skipped. */
export type Objects =
  | { traverse(visit: (object: any) => void): void }
  | { getDescendants(): any[] }
  | { getNodes(): any[] }
  | Iterable<Movable & { name: string }>
  | Record<string, Movable>
  | ((name: string, index: number) => Movable | null | undefined);

export interface PlayerSettings {
  /** Start time in seconds. */
  time?: number;
  /** Default 1; negative plays backwards. */
  speed?: number;
  /** Default `repeat`. */
  loop?: 'clamp' | 'repeat' | 'pingpong';
  /** Default true. */
  playing?: boolean;
}

export interface PlayOptions
  extends PlayerSettings,
    Pick<PoseOptions, 'clip' | 'nodes' | 'interpolation' | 'retarget' | 'map' | 'feet' | 'root_motion' | 'root_axes' | 'in_place'>,
    Abortable {
  /** Poses fetched per second of the clip, default 60; the player interpolates between them by slerp and linearly. */
  fps?: number;
}

/** Plays a table of poses on the local clock. */
export class Player {
  /** table: poses `as` trs, with ascending times. */
  constructor(objects: Objects, table: PoseTable, settings?: PlayerSettings);
  readonly table: PoseTable;
  /** Names of nodes without an object. */
  readonly missing: string[];
  readonly duration: number;
  /** Seconds within the clip; set it to seek. */
  time: number;
  speed: number;
  loop: 'clamp' | 'repeat' | 'pingpong';
  playing: boolean;
  /** With `root_motion`: the motion of the whole figure since time 0 of the clip, as `update` found it. */
  readonly root?: RootMotion;
  /** The morph weights that `update` gave the meshes, where the clip moves any. */
  readonly weights?: MorphWeights;
  /** Moves the objects; call for each rendered frame. now: milliseconds, as requestAnimationFrame passes. Returns `time`. */
  update(now?: number): number;
}

export interface LivePlayOptions extends Omit<LiveOptions, 'space' | 'as' | 'order' | 'unit' | 'skinning'>, Abortable {
  /** Milliseconds that objects lag behind the server, so that late frames still arrive in time. Default: 100 plus one frame. */
  delay?: number;
}

/** Plays the live stream by the server's clock; reconnects and continues when the stream breaks. */
export class LivePlayer {
  readonly missing: string[];
  /** Seconds within the clip that `update` showed last. */
  readonly time?: number;
  /** Whether the stream has ended with the clip. */
  readonly ended: boolean;
  /** Whether the stream comes: false while it waits for the daemon to answer again. */
  readonly connected: boolean;
  delay: number;
  /** As of Player. */
  readonly root?: RootMotion;
  readonly weights?: MorphWeights;
  /** The server's current Unix time in milliseconds. */
  readonly serverTime: number;
  /** Resolves when the stream ends or is closed; rejects when it cannot continue. */
  readonly done: Promise<void>;
  /** Moves the objects; call for each rendered frame. Returns `time`. */
  update(now?: number): number | undefined;
  close(): void;
}
// ---- from openapi.json, by tests/client/types.mjs ----

/** RFC 9457. */
export interface Problem {
  /** `urn:tweend:problem:` and a name for the kind of problem. */
  type: string;
  title: string;
  status: number;
  /** What is wrong, in words; begins with the pointer or the line, if there is one. */
  detail: string;
  /** The request's id. */
  instance: string;
  errors?: {
    /** RFC 6901 pointer into the document that was sent, or into the glTF JSON of a GLB. */
    pointer: string;
    detail: string;
  }[];
  /** Line of an OBJ, from 1. */
  line?: number;
  /** Column in that line, in characters from 1, if a word is not a number or not a corner. */
  column?: number;
  /** The counts that the surface would have had. */
  predicted?: {
    vertices: number;
    edges: number;
    faces: number;
    /** Of the answer, where it is known. */
    bytes?: number;
  };
  /** The supported types or codings, for 406 and 415. */
  supported?: string[];
}
export interface Listed {
  id: string;
  name: string | null;
  format: Format;
  bytes: number;
}
export type Format = "obj" | "tweend" | "gltf" | "glb" | "stl" | "ply" | "bvh";
export interface ModelList {
  models: Listed[];
  /** URL of the next page. */
  next: string | null;
}
export interface MeshFacts {
  name: string | null;
  /** Number of points that faces use. */
  vertices: number;
  edges: number;
  faces: number;
  /** Number of faces by their number of corners. */
  face_sizes: {
    [key: string]: number;
  };
  /** Number of edges with one face. */
  boundary_edges: number;
  /** Number of closed loops of the border. Loops that only share a point are counted separately. */
  boundary_loops: number;
  /** Number of edges with three or more faces, or with two that run along it in the same direction, of which one is
   * flipped. */
  nonmanifold_edges: number;
  /** Number of points whose faces are not one fan: ends of such edges, and points where faces only touch. */
  nonmanifold_vertices: number;
  /** The first 64 places of each kind, by point indices; absent if there are none. */
  nonmanifold?: {
    edges: number[][];
    vertices: number[];
  };
  /** Number of vertices of the file that were merged into another point (`weld`). */
  welded_points: number;
  /** Number of border edges that lie on another border by position: open seams. */
  seam_edges: number;
  /** Number of edges along which two faces run in the same direction, so that one of them is wound the wrong way.
   * The surface is open there if the two have separate points, else it has a crease. */
  reversed_edges: number;
  /** The first 64 of them, by their points; absent if there are none. */
  reversed?: number[][];
  /** Number of manifold vertices with a valence other than 4, at the border other than 3 (corners: 2). */
  extraordinary_vertices: number;
  /** Number of extraordinary vertices by their valence, which is their number of edges. */
  extraordinary_valences: {
    [key: string]: number;
  };
  /** Number of pieces that share no point. */
  components: number;
  /** Vertices - edges + faces. */
  euler_characteristic: number;
  bounds: {
    min: number[];
    max: number[];
  };
  unused_points: number;
  /** Number of edges that tags make sharp. */
  creases: number;
  /** Number of vertices that tags make sharp. */
  corners: number;
  /** Number of faces that tags leave out of surfaces. */
  holes: number;
  /** Number of edges that each value of `creases` finds, whether tagged or not. */
  hard_edges: {
    tags: number;
    normals: number;
    angle_30: number;
    auto: number;
    /** What the default adds to the tags. */
    file: number;
  };
  /** Number of quads made from pairs of triangles, as `quads=auto` makes them, the default for glTF and STL. */
  paired_quads: number;
  /** Number of different sets of named groups that faces are in. */
  group_count: number;
  /** The first 64 of them, in the order of the file. */
  groups: {
    names: string[];
    faces: number;
  }[];
  uv_sets: number;
  morph_targets: number;
  /** The levels that have details. */
  details: number[];
  skinned: boolean;
}
export interface Model {
  id: string;
  name: string | null;
  format: Format;
  bytes: number;
  meshes: MeshFacts[];
  nodes: {
    /** A node without a name is `node_3` by its index. */
    name: string;
    parent: string | null;
    /** Index into meshes. */
    mesh: number | null;
    /** Index into skins. */
    skin: number | null;
    rest: {
      translation: number[];
      rotation: number[];
      scale: number[];
      /** Present if the file has one; column-major. */
      matrix?: number[];
    };
  }[];
  /** Of VRM and VRMA files (`VRMC_vrm`, `VRM`, `VRMC_vrm_animation`): the node of each bone, by VRM 1.0's names
   * (`hips`, `leftUpperLeg`, …), by which VRM 0.x's thumbs go too. Absent in other files. */
  humanoid?: {
    [key: string]: string;
  };
  skins: {
    name: string | null;
    skeleton: string | null;
    joints: string[];
  }[];
  clips: {
    /** A clip without a name is `clip_0` by its index. */
    name: string;
    /** Seconds. Null for a mixed clip with layers of other models: `pose` tells it. */
    duration: number | null;
    tracks: number;
    /** Of all tracks. */
    keys: number;
    /** Of a mixed clip only, which has no tracks of its own. */
    layers?: {
      clip: string;
      mode: "replace" | "additive";
    }[];
  }[];
  /** In an answer to edits: what each edit with a name made, as indices in the new model. */
  made?: {
    [key: string]: {
      faces: number[];
      vertices: number[];
    };
  };
  /** In an answer to coarsen: the number of steps undone. */
  levels?: number;
  warnings: string[];
}
/** Faces that edges connect. Lengths are in `unit`. */
export interface Shell {
  /** Every edge is of two faces, which run along it in opposite directions. */
  closed: boolean;
  /** Closed, and its faces show inwards, as those round a cavity do. */
  inverted: boolean;
  faces: number;
  triangles: number;
  /** Edges of one face. */
  open_edges: number;
  /** Edges of more than two faces. */
  crowded_edges: number;
  /** Edges of two faces, one of which is wound the wrong way round. */
  flipped_edges: number;
  area: number;
  /** Null unless the shell is closed; below 0 if it is inverted. */
  volume: number | null;
}
/** With `shells=true`: all shells in world space, each mesh once for each node that shows it, as `surface.stl` has
 * them. */
export interface Solid {
  /**
   * By `unit` and `scale`, else metres.
   */
  unit: "mm" | "cm" | "m" | "um" | "in" | "ft";
  shells: number;
  closed: number;
  inverted: number;
  triangles: number;
  /** Edges of one face. */
  open_edges: number;
  /** Edges of more than two faces. */
  crowded_edges: number;
  /** Edges of two faces, one of which is wound the wrong way round. */
  flipped_edges: number;
  /** Of all triangles. */
  area: number;
  /** Of the closed shells. */
  volume: number;
}
export interface SurfaceCounts {
  /** Where meshes have different ones: the highest. */
  level: number;
  /** With `level=auto`: how far the triangles are from the limit surface at most, in the unit of the model; null
   * where that is not known. */
  error?: number | null;
  /** Number of merged points, without the splits that glTF needs. */
  vertices: number;
  edges: number;
  faces: number;
  /** Of the GLB under the same options, exactly. */
  bytes: number;
  /** Bytes of the answer in each form under the same options, exactly; of the forms whose size is known beforehand.
   * PLY of models with skins or morph targets, and with `level=auto` their STL, are among them with `skin=bake`
   * alone: they are of the moved meshes. Forms that refuse the options have no place here: with `meshes=none` and
   * with clips or several times there are glTF forms alone. */
  forms: {
    glb: number;
    gltf?: number;
    stl?: number;
    ply?: number;
    /** With positions alone; if the model has one mesh, and nothing poses it. */
    bin?: number;
  };
  solid?: Solid;
  meshes: {
    name: string | null;
    level: number;
    /** With `level=auto`: of this mesh. */
    error?: number | null;
    /** Number of merged points, without the splits that glTF needs. */
    vertices: number;
    edges: number;
    faces: number;
    /** Size of a GLB with this mesh only, without materials. */
    bytes: number;
    /** With `shells=true`. */
    shell_count?: number;
    /** With `shells=true`: the mesh's first shells, in its own space. */
    shells?: Shell[];
  }[];
}
export interface Levels {
  levels: {
    level: number;
    /** Number of merged points, without the splits that glTF needs. */
    vertices: number;
    edges: number;
    faces: number;
    /** Of the GLB under the same options, exactly; null where it is not known. */
    bytes: number | null;
    /** How far the triangles of all meshes are from their limit surfaces at most, in the unit of the model, as
     * `level=auto` finds it; null where that is not known. Absent with `boundary=open`. */
    error?: number | null;
    /** Of the last level, where it is over a limit: which. */
    refused?: string;
  }[];
}
/** A motion of the whole figure in the world since time 0: in front of all transforms, first the rotation (x y z
 * w), then the translation. */
export interface RootMotion {
  translation: number[];
  rotation: number[];
}
/** One entry for each node, in the order of `nodes`. */
export interface Pose {
  /** Seconds, as asked for. */
  t: number;
  /** as=trs: x y z w. */
  rotation?: number[][];
  /** as=euler. */
  euler?: number[][];
  /** as=axis-angle: x y z angle. */
  axis_angle?: number[][];
  /** as=matrix: column-major; replaces all others. */
  matrix?: number[][];
  /** Morph weights by the node's name (`node_3` by its index where an earlier node has the name), of the nodes
   * whose weights the clip moves; left out where it moves none. */
  weights?: {
    [key: string]: number[];
  };
  translation?: number[][];
  scale?: number[][];
  /** With `root_motion`: what was taken out of the pose. */
  root?: RootMotion;
}
export interface Poses {
  /** Several names, separated by commas, if several clips play together. null: no clip, the rest pose. */
  clip: string | null;
  /** Seconds. A borrowed clip is as long as in its own model, whichever of its nodes are here. */
  duration: number;
  space: "local" | "world";
  as: "trs" | "matrix" | "euler" | "axis-angle";
  /** With as=euler. */
  order?: string;
  /** With as=euler and as=axis-angle. */
  unit?: string;
  /** Nodes of a borrowed clip that are missing in the model, bones of one that was carried over without
   * counterpart, and layers of a mixed clip that move nothing or stand still. */
  warnings?: string[];
  nodes: string[];
  /** With skinning=true. */
  skins?: {
    name: string | null;
    /** Index of the skin's first joint in `nodes`. */
    first: number;
    count: number;
  }[];
  times: number[];
  poses: Pose[];
}
export interface Times {
  times?: number[];
  /** As the parameter `map`. With it `times` may be left out, or be in the query. */
  map?: {
    [key: string]: string | null;
  };
}
/**
 * XYZ: R = Rx Ry Rz (intrinsic). Default: `XYZ`.
 */
export type EulerOrder = "XYZ" | "XZY" | "YXZ" | "YZX" | "ZXY" | "ZYX";
export interface RotationsRequest {
  rotations: {
    /** x y z w, of any length but 0. */
    quaternion?: number[];
    /** The axis, of any length but 0, and the angle. */
    axis_angle?: number[];
    /** The angles about x, y, z, whatever the order. */
    euler?: number[];
    order?: EulerOrder;
    /** Nine numbers, or sixteen with 0 0 0 1 as the last row and column; column-major. Columns may deviate from
     * unit length and right angles by 0.001. */
    matrix?: number[];
  }[];
  /**
   * Unit of all angles, in the request and in the answer. Default: `radians`.
   */
  unit?: "radians" | "degrees";
  /**
   * What the answer has; `order` is that of `euler`, and ignored with the others. Default: `quaternion`.
   */
  as?: "quaternion" | "axis-angle" | "euler" | "matrix";
  order?: EulerOrder;
  /** Points that each rotation turns; at most 100,000 points times rotations. */
  points?: number[][];
  /** Parameters at which the short way from the first rotation (0) to the last (1) is sampled; values outside
   * extrapolate. At most `--max-times`. */
  slerp?: number[];
}
/** In the form given by `as`: x y z w; x y z angle, with an angle from 0 to half a turn; angles about x, y, z, with
 * 0 for the order's last axis at gimbal lock; nine numbers, column-major. */
export type Rotation = number[];
export interface Rotations {
  rotations: {
    quaternion?: Rotation;
    axis_angle?: Rotation;
    euler?: Rotation;
    matrix?: Rotation;
    inverse: Rotation;
    /** The request's points after the rotation; absent if it has none. */
    points?: number[][];
    /** For each Euler order, |cos| of the middle angle: 1 is farthest from gimbal lock, 0 is lock. */
    orders: {
      [key: string]: number;
    };
  }[];
  product: Rotation;
  slerp?: Rotation[];
}
export interface Tracks {
  clip: string;
  tracks: {
    node: string;
    /** @constant */
    path: "rotation";
    kind: "quaternion" | "euler" | "axis-angle";
    interpolation: "step" | "linear" | "cubicspline" | "nlerp" | "squad" | "euler";
    keys: number;
    /** Key times in seconds. */
    times: number[];
    /** Time of the first key. */
    start: number;
    /** From the first key to the last. */
    duration: number;
    /** Degrees travelled along the path. */
    total_degrees: number;
    /** The largest step from one key to the next, in degrees. */
    largest_step_degrees: number;
    /** The key at which that step begins. */
    largest_step_key: number;
    peak_degrees_per_second: number;
    peak_time: number;
    /** Number of keys whose sign differs from the key before: q and -q are the same rotation. */
    sign_flips: number;
    non_unit_keys: number;
    /** Number of keys that the file has at the time of the key before: the rotation jumps there. Of several keys at
     * one time the first and the last are kept, the first at the next smaller float. */
    duplicate_times: number;
    /** Number of steps of exactly 180 degrees. */
    half_turns: number;
    /** Number of steps over 180 degrees, which quaternions would shorten. */
    steps_over_180: number;
    /** Number of Euler keys with an angle that differs by more than 180 degrees from the key before. */
    euler_wraps: number;
    /** Only for Euler tracks. */
    slerp_stray?: {
      /** The largest distance between interpolating each angle on its own and slerp between the same keys. */
      degrees: number;
      time: number;
    };
    /** In the track's own order, or XYZ if it has none. */
    gimbal: {
      order: string;
      time: number;
      /** Least |cos| of the order's middle angle along the path: 1 is farthest from lock, 0 is lock. */
      cos_middle: number;
      /** 1 / cos_middle; null at lock. */
      amplification: number | null;
      /**
       * The axis that turns like the order's first axis at lock.
       */
      lost_axis: "x" | "y" | "z";
    };
    /** cos_middle of each order. */
    orders: {
      XYZ: number;
      XZY: number;
      YXZ: number;
      YZX: number;
      ZXY: number;
      ZYX: number;
    };
    /** The order whose worst time is farthest from lock. */
    best_order: string;
    warnings: string[];
  }[];
  other_tracks: {
    node: string;
    path: "translation" | "scale" | "weights";
    interpolation: "step" | "linear" | "cubicspline";
    keys: number;
    /** Key times in seconds. */
    times: number[];
  }[];
  report: ClipReport;
  /** With `root_motion` or `in_place`: what of it has come together at the end of the clip. All else of the answer
   * is of the clip without it, but for `report.contacts`, which are judged with it put back. */
  root_motion?: {
    /** Whose motion was taken out. */
    node: string;
    /** As in `root_axes`. */
    axes: string;
    translation: number[];
    rotation: number[];
  };
  retarget?: Retarget;
  /** Of a mixed clip: its layers, and those of clips that it mixes, whose clips were carried over. */
  layers?: {
    /** The mixed clip that has the layer. */
    clip: string;
    /** The layer's index. */
    layer: number;
    /** The layer's `clip`. */
    plays: string;
    retarget: Retarget;
  }[];
}
/** How a clip was carried over, with `retarget=auto`. A VRMA of a face alone needs no bones. */
export interface Retarget {
  bones: {
    /** The node of the clip's model. */
    source: string;
    /** The node of this model. */
    target: string;
    /**
     * What matched them: the map, humanoid maps, equal names, usual names.
     */
    by: "map" | "humanoid" | "name" | "usual";
    /** Degrees by which the model's rest pose was turned to point where the clip's model points. */
    aligned: number;
  }[];
  /** By which the hips' way is longer here. */
  scale: number;
  /** Bones that the clip moves and nothing here follows. */
  without_target: string[];
  /** Bones of this model that keep their rest pose. */
  without_source: string[];
}
/** The clip as a whole, from its first key to its end. Lengths in the model's unit, times in seconds. Motion is
 * followed at 60 frames a second. */
export interface ClipReport {
  /** How the last pose differs from the first, each node relative to its parent. */
  loop: {
    /** Degrees: the largest of all nodes. */
    angle: number;
    /** The largest of all nodes. */
    distance: number;
    /** The node of the angle, or of the distance where nothing turns; null where both are 0. */
    node: string | null;
    /** Degrees a second: the largest difference of angular velocities between the end and the beginning. */
    speed: number;
  };
  /** The way in the world of the topmost node that the clip moves. */
  root: {
    /** null: the clip moves no node. */
    node: string | null;
    /** From the first place to the last, straight. */
    distance: number;
    /** The length of the way by the seconds from the first key to the end. */
    speed: number;
    /** Degrees about +y from the first pose on, whole turns included. */
    turn: number;
  };
  /** Nodes that the clip does not move by themselves. */
  still: string[];
  /** Nodes whose contacts are told: those of `feet=`, of the humanoid map, or with `foot` in their names, else
   * `ankle`. Where it is empty contacts are not looked for. */
  feet: string[];
  /** Times of three frames or more in which a foot stands: slower than a quarter of the figure's height a second,
   * and less than 3 % of that height above its lowest place; or above where it stands, as on steps and slopes, if
   * in the quarters of a second before and after it is higher, together by 1 % of that height; at the clip's ends,
   * if on its way to or from the next place where it is slow it is that much above the straight line. */
  contacts: {
    node: string;
    from: number;
    to: number;
    /** The largest horizontal distance from where the foot was first. */
    slide: number;
  }[];
  /** Tracks of seven keys or more that do not step. */
  noise: {
    node: string;
    path: "translation" | "rotation" | "scale" | "weights";
    /** What a parabola through seven keys leaves of the middle one, as root of the mean square: degrees for
     * rotations, the model's unit for translations, else the values' unit. */
    rms: number;
  }[];
  /** Single keys of rotations over 5 degrees, and over eight times the track's median, away from where their
   * neighbours lead, which are at most 0.1 s apart. */
  pops: {
    node: string;
    time: number;
    /** Degrees. */
    angle: number;
  }[];
  /** Why contacts were not looked for. */
  warnings: string[];
}
/** A cage centred on the origin, closed except for `grid` and open caps. Faces look outward; points are sorted by
 * y, then z, then x. UVs are those of three.js. `--max-faces` and `--max-memory` limit all shapes of a document
 * together. */
export type Shape = {
  /** @constant */
  kind: "grid";
  /** Size along x and z. Default: `[1, 1]`. */
  size?: number[];
  /** Default: `[1, 1]`. */
  segments?: number[];
} | {
  /** @constant */
  kind: "box";
  /** Default: `[1, 1, 1]`. */
  size?: number[];
  /** Default: `[1, 1, 1]`. */
  segments?: number[];
} | {
  /** @constant */
  kind: "quad_sphere";
  /** Default: 1. */
  radius?: number;
  /** Default: 16. */
  segments?: number;
} | {
  /** @constant */
  kind: "uv_sphere";
  /** Default: 1. */
  radius?: number;
  /** Default: 16. */
  segments?: number;
  /** Bands from pole to pole. Default: 8. */
  rings?: number;
} | {
  /** @constant */
  kind: "icosphere";
  /** Default: 1. */
  radius?: number;
  /** Default: 1. */
  level?: number;
} | {
  /** @constant */
  kind: "ellipsoid";
  /** Default: `[1, 1, 1]`. */
  radii?: number[];
  /** Default: 16. */
  segments?: number;
} | {
  /** @constant */
  kind: "cylinder";
  /** Default: 1. */
  radius?: number;
  /** Default: 1. */
  height?: number;
  /** Default: 16. */
  segments?: number;
  /** Bands from top to bottom. Default: 1. */
  rings?: number;
  /**
   * Default: `ngon`.
   */
  caps?: "ngon" | "fan" | "none";
} | {
  /** @constant */
  kind: "cone";
  /** Default: 1. */
  radius?: number;
  /** Default: 1. */
  height?: number;
  /** Default: 16. */
  segments?: number;
  /** Bands from top to bottom. Default: 1. */
  rings?: number;
  /**
   * Default: `ngon`.
   */
  caps?: "ngon" | "fan" | "none";
} | {
  /** @constant */
  kind: "torus";
  /** Distance from the centre to the middle of the tube. Default: 1. */
  radius?: number;
  /** Radius of the tube, less than `radius`. Default: 0.4. */
  tube?: number;
  /** Number of segments around the y axis. Default: 16. */
  segments?: number;
  /** Number of sides around the tube. Default: 8. */
  sides?: number;
};
/** An empty selection is an error, unless the edit is `optional`. */
export type FaceSelection = number[] | "all" | {
  group: string;
} | {
  /** Its index or name. */
  material: number | string;
} | {
  facing: number[];
  /** Degrees. Default: 45. */
  within?: number;
} | {
  inside: {
    min: number[];
    max: number[];
  };
} | {
  made: string;
};
/** An empty selection is an error, unless the edit is `optional`. */
export type EdgeSelection = number[][] | ("all" | "border") | {
  loop: number[];
} | {
  ring: number[];
} | {
  /** Degrees. */
  sharper_than: number;
} | {
  inside: {
    min: number[];
    max: number[];
  };
} | {
  made: string;
};
/** An empty selection is an error, unless the edit is `optional`. */
export type VertexSelection = number[] | "all" | {
  inside: {
    min: number[];
    max: number[];
  };
} | {
  made: string;
};
/** Indices refer to the mesh as the edit finds it. New faces and vertices follow those that stay. `name` lets later
 * edits select what this edit makes. Lengths are in the model's unit, angles in degrees. Coordinates are the
 * mesh's: in a document those of its `positions`; in a request about a mesh that lies far from the origin those
 * relative to the offset that a warning of the model names. `inside` takes points on the sides of its box. */
export type Edit = {
  /** @constant */
  edit: "extrude";
  faces: FaceSelection;
  /** Distance along the normals. */
  distance?: number;
  /** A vector, instead of a distance. */
  by?: number[];
  /** Default: false. */
  individual?: boolean;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "inset";
  faces: FaceSelection;
  amount: number;
  /** Default: false. */
  individual?: boolean;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "loop_cut";
  edge: number[];
  /** Default: 1. */
  cuts?: number;
  /** The place of each cut, ascending, between 0 (the edge's first vertex) and 1; default: evenly spaced. */
  at?: number[];
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "subdivide";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  /** Default: 1. */
  cuts?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "delete";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "merge";
  vertices: VertexSelection;
  /** Merges vertices within this distance, each into the first of them, whose joints, weights and displacements
   * stay; a warning tells of others that are lost. Default: merges all, into their mean. */
  distance?: number;
  /** Position of the merged vertex; default: the mean. */
  to?: number[];
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "fill";
  /** An edge of the hole; default: every hole. */
  border?: number[];
  max_edges?: number;
  /**
   * `triangles`: triangles of the least total area. `fair`: triangles as large as those around the hole, which
   * continue the curvature of the mesh. Default: `ngon`.
   */
  method?: "ngon" | "triangles" | "fair";
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "mirror";
  axis: "x" | "y" | "z";
  /** Vertices within this distance of the plane are moved onto it and merged with their image; displacements of
   * morph targets do not lead them off it. `false` or a negative number: none; `true`: the default. Default:
   * 0.000001. */
  weld?: number | boolean;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "move";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  by: number[];
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "rotate";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  axis: ("x" | "y" | "z") | number[];
  degrees: number;
  /** Default: the mean of the vertices. */
  about?: number[];
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "scale";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  by: number | number[];
  /** Default: the mean of the vertices. */
  about?: number[];
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "crease";
  edges: EdgeSelection;
  /** 10 is infinite; 0 removes the tag. Default: 10. */
  sharpness?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "corner";
  vertices: VertexSelection;
  /** Default: 10. */
  sharpness?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "hole";
  faces: FaceSelection;
  /** 0 makes it a face again. Default: 10. */
  sharpness?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  edit: "flip" | "orient" | "triangulate" | "quads";
  faces?: FaceSelection;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "weld";
  /** Default: 0. */
  distance?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "drop_pieces";
  faces: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "despike";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  /** Default: 2. */
  factor?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
} | {
  /** @constant */
  edit: "smooth";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  /**
   * Default: `taubin`.
   */
  method?: "taubin" | "laplacian";
  /** Default: 10. */
  iterations?: number;
  name?: string;
  /** Default: false. */
  optional?: boolean;
};
export interface EditsRequest {
  /** Name of the mesh; optional if there is only one. */
  mesh?: string;
  edits: Edit[];
}
/** A layer of a mixed clip. At most 64 layers, 8 mixed clips below one another, and 256 clips in the end. */
export interface Layer {
  /** A clip of this document, before or after this one, or `{model id}/{name}`: a clip of another stored model,
   * whose tracks move nodes by their names. `clip_1` names a clip by its place unless one is called so. */
  clip: string;
  /**
   * Default: `replace`. Layers that replace are blended by their weights over their sum, rotations by the sum of
   * quaternions on one hemisphere at unit length; where all weights are 0 the rest pose stands. Then additive ones
   * apply in order: q slerp(1, reference⁻¹ clip, weight), the short way; other values plus weight (clip -
   * reference).
   */
  mode?: "replace" | "additive";
  /** Default: 1. A number, or keys, linear between them and constant outside. Below 0 in additive layers only. */
  weight?: number | {
    times: number[];
    values: number[];
  };
  /** Seconds of the layer's clip in a second. Default: 1. Above 0 with `sync`. */
  speed?: number;
  /** The time of the layer's clip at time 0, seconds. Default: 0. Negative: it starts later. */
  offset?: number;
  /**
   * What the layer shows beyond its clip's ends. Default: `clamp`. Not with `sync`, which repeats.
   */
  loop?: "clamp" | "repeat" | "pingpong";
  /** Default: false. Layers with `sync` play in one phase: it rises by the mean of speed / duration of those that
   * replace, weighted by their weights, and each is stretched to it. */
  sync?: boolean;
  /** Roots of the subtrees that the layer moves. Default: all nodes. */
  nodes?: string[];
  /** With mode `additive`: the time of the layer's clip whose pose adds nothing, seconds. Default: 0. */
  reference?: number;
  /**
   * Of another model's clip. Default: `none`; `auto` carries it over to this model's skeleton.
   */
  retarget?: "none" | "auto";
  /** With `retarget` `auto`: pairs of bones, as the parameter `map` of requests. */
  map?: {
    [key: string]: string | null;
  };
  /**
   * With `retarget` `auto`: `hold` keeps feet where they touched, as the parameter `feet` of poses.
   */
  feet?: "hold";
}
export interface Health {
  status: string;
}
export interface Version {
  name: string;
  version: string;
  api: string;
}
export interface SignRequest {
  /**
   * URL of a GET of this daemon, percent-encoded: absolute (`http` or `https`), or path and query. Path and query
   * are signed.
   * @example /v1/models
   */
  url: string;
  /** Default: 3600. */
  seconds?: number;
}
export interface SignedUrl {
  url: string;
}
export interface ListOptions {
  /**
   * Models on each page.
   * @default 100
   */
  limit?: number;
  /** Lists models with ids after this one; the `next` of a page holds it. */
  after?: string;
}
export interface SourceOptions {
  /**
   * `1` sends `Content-Disposition: attachment` with the model's name, so that browsers save the answer.
   * @default 0
   */
  download?: "0" | "1";
}
export interface SurfaceOptions {
  /**
   * Number of subdivision steps, up to the configured limit (10); 0 is the cage. `auto`: for each mesh the least
   * level that `error` allows, or the highest that `faces` does; with both the lower of the two; with neither as
   * with `error=0.1%&faces=200000`. `X-Tweend-Level` and `surface.json` tell what was chosen, `X-Tweend-Error` how
   * near it is. Not with `boundary=open` of a mesh with a border, whose levels shrink.
   * @default 1
   */
  level?: number | "auto";
  /** Of `level=auto`: how far the answer's triangles may be from the limit surface, and it from them, anywhere: a
   * distance in the unit of the model (before `unit` and `scale`), or a share of the model's size as `0.1%`. The
   * size is the diagonal of the box around the cages as nodes place them. A mesh that nodes scale is measured as
   * large as its largest; a skinned one, or one with morph targets, that `skin=bake` does not pose, at rest. The
   * distance is a bound that is proved: the true one is usually 1 to 2 times smaller. It does not count what
   * `encoding` rounds. Where `--max-level` does not reach it, and `faces` is not given, the answer is 422. */
  error?: number | string;
  /** Of `level=auto`: the most faces that the answer may have. If the cage itself has more, the answer is level 0.
   * A warning tells of an `error` that it does not allow. */
  faces?: number;
  /**
   * Subdivision scheme; `loop` needs triangles, and joins none by default (see `quads`).
   * @default catmull-clark
   */
  scheme?: "catmull-clark" | "loop" | "bilinear";
  /**
   * Rule at borders: OpenSubdiv's three, or `open`, which makes new points only where all parents exist, so that
   * the surface shrinks from the mesh's border (holes are not a border). Overrides a tag of the file.
   * @default edge-and-corner
   */
  boundary?: "edge-and-corner" | "edge-only" | "none" | "open";
  /**
   * OpenSubdiv's face-varying linear interpolation rule. Overrides a tag of the file. A value that comes, goes and
   * comes again around a point stays as it is by every rule.
   * @default corners-only
   */
  uv?: "corners-only" | "none" | "corners-plus1" | "corners-plus2" | "boundaries" | "all";
  /**
   * How sharpness decays. Overrides a tag of the file.
   * @default uniform
   */
  creasing?: "uniform" | "chaikin";
  /**
   * Which edges are creases. `file`: those tagged in the file where a mesh has any tag of subdivision; else what
   * the file shows, as `auto` finds it, in pieces with normals or smoothing groups, and in STL, which only angles
   * can tell of; else none, so that a cube without normals becomes a ball. A warning counts the edges that are kept
   * hard. `tags`: only edges tagged in the file. The next three values add edges; a tagged edge keeps its own
   * sharpness. `normals`: edges whose two faces have normals in the file that differ at an end by over half a
   * degree; without normals, edges between OBJ smoothing groups, or in `s off`. `angle:DEGREES` (0 to 180, as
   * `angle:30`): edges at which the faces turn by more. `auto`: like `normals` in pieces (faces connected by
   * points) that also have smooth edges; in pieces that are flat-shaded throughout, or for which the file has no
   * information, edges at which the faces turn by more than 50 degrees. With `auto` and `file` a point at which a
   * line of two such edges, or of two borders (with `boundary=edge-and-corner`), turns by more than 50 degrees is a
   * corner. `none`: no creases and no sharp vertices. `boundary` still applies to borders. The description counts
   * these edges as `hard_edges`.
   * @default file
   */
  creases?: string;
  /**
   * Sharpness of the edges that `creases` adds: 0 to 10; 10 is the same as `infinite`.
   * @default infinite
   */
  crease_sharpness?: number | "infinite";
  /**
   * Weights on triangles: `smooth` is OpenSubdiv's TRI_SUB_SMOOTH. Overrides a tag of the file.
   * @default catmull-clark
   */
  triangles?: "catmull-clark" | "smooth";
  /**
   * Which points of the file are merged. `auto` merges the ends of two border edges that run between the same two
   * positions in opposite directions, if no third edge does: seams cut by an exporter close, while sheets that only
   * touch stay apart. Faces that are listed twice or collapse, and slivers between the two sides of a seam, keep it
   * from closing: they are left out with a warning. tweend JSON and an OBJ with subdivision tags (`t`) are not
   * changed. `exact` also merges all points at the same position; a distance, in the model's unit, all points
   * within it of a first one. `none` keeps the vertices of the file. Faces left with fewer than three points are
   * dropped. The description has the `welded_points` of `auto`.
   * @default auto
   */
  weld?: ("auto" | "exact" | "none") | number;
  /**
   * How triangles become polygons; OBJ, PLY and tweend JSON keep theirs. By default `auto` for glTF and STL, which
   * cannot store polygons, with a warning that counts what was joined; `ngon` with `scheme=loop`. `ngon`: only by
   * FB_ngon_encoding. `auto` also joins pairs of triangles that an exporter split from quads: consecutive triangles
   * in the pattern that most of them have, then pairs that look like a split rectangle; never across a material, a
   * UV seam or a hard edge, and not in a mesh with few such pairs. The description counts the `paired_quads`.
   */
  quads?: "ngon" | "auto" | "off";
  /**
   * Moves the points to the limit surface.
   * @default false
   */
  limit?: boolean;
  /**
   * `auto`: at level 0 the file's own normals and tangents, at unit length and split as in the file (not with
   * `limit=true`, nor for meshes that `skin=bake` moves); otherwise as `limit`. `limit`: the exact normals of the
   * limit surface, at every level and with every value of the parameter `limit`; unit length, split along
   * infinitely sharp edges. `none`: no normals. Where a point has no single tangent plane (its faces are not one
   * fan, two faces lie back to back, or the surface is bilinear), each face has there the normal of its two edges.
   * Where the two tangents are parallel or zero, the normal is that of the refined faces around the point, or else
   * 0 1 0; so no normal is zero or not a number.
   * @default auto
   */
  normals?: "auto" | "limit" | "none";
  /** Which clips the answer keeps as glTF animations. Default: all clips of the model, at their indices, but for
   * mixed ones with layers of models that are not stored, which a warning names and for which such an answer is
   * `no-cache`; else those named, separated by commas (at most 256), in that order. `{model id}/{name}` borrows a
   * clip of another stored model, matching nodes by name; `none` keeps no clip. A value that equals a clip's whole
   * name, even with commas or `none`, means that clip. With times, the clips (default: the first) play together; if
   * two clips move the same path of a node, the later one in the list wins. One time poses the model; several bake
   * one animation with keys at exactly these times, whose bytes are limited like an upload's. */
  clip?: string;
  /** Times in seconds, separated by commas. */
  at?: string | number | number[];
  /**
   * Of borrowed clips. `none`: matched by the names of nodes, values as they are. `auto`: carried over to this
   * model's skeleton. Bones are matched by `map`, then by humanoid maps (VRM), equal names, and the names that
   * usual rigs have (Mixamo, CMU and other BVH, Rigify and Blender, Unreal's mannequin, MakeHuman, Ready Player Me,
   * Unity, VRoid, Biped, SMPL, DAZ, Character Creator, Auto-Rig Pro, AdvancedSkeleton, Perception Neuron, Roblox
   * R15, Motive, Kinect, Xsens, Biovision, Rokoko, ARKit, VRChat, MikuMikuDance). Rotations go over relative to
   * each rest pose; limbs that rest otherwise are aligned from joint to joint, so that the hand points where the
   * source's points; a source that rests with its legs folded up beside the trunk (LaFAN1) counts as resting as it
   * stands straightest in the clip, which X-Tweend-Warning tells; bones in between share the motion, or are taken
   * into it; a spine that bends at other joints swings as a whole, so that neck and shoulders are where the clip
   * has them, and its first joint moves by what turning cannot reach; hips move by the ratio of leg lengths, and
   * between humanoid maps by that of hip heights. Expressions and gaze of a VRMA go over to a VRM's face either
   * way. Bones that the clip moves and that have no counterpart are a warning with the first of their names. 422
   * where fewer than half of the bones match, of those that the clip moves or of the model's where these are fewer,
   * and without a skeleton. Own clips stay as they are; where no other is asked for, X-Tweend-Warning tells that
   * `auto` does nothing.
   * @default none
   */
  retarget?: "none" | "auto";
  /** With `retarget=auto`: a JSON object of pairs of bones, `{"source node": "target node"}`, that count before all
   * others; null for a bone of the source that shall move nothing. At most 1,024 pairs. An unknown name, or a
   * target named twice, is 422. */
  map?: string | {
    [key: string]: string | null;
  };
  /**
   * With `retarget=auto`, `hold`: while a foot of the clip's own figure touches the ground, this model's foot
   * stands still, as seen from above. The leg bends and swings for it (inverse kinematics of two bones); the foot
   * keeps its height and rotation, and comes and goes within 0.15 s. Where a leg is too short for it, the hips go
   * down softly within 0.3 s, with all that is above them, by up to a tenth of the leg's length. A warning where no
   * foot could be held.
   */
  feet?: "hold";
  /** The name of a node whose motion moves the whole figure, or `auto`: the topmost node that the clip translates,
   * else turns, and of several the one with most nodes below; tracks whose value never changes, as of exporters
   * that bake, do not count. The part of its motion in the world that `root_axes` names, counted from time 0, is
   * taken out of the poses, and told beside them: as `root` of each pose, and in glTF as tracks of the skeleton's
   * topmost node, above which stands a new node `root` where the motion is its own. The motion in front of the
   * poses gives the clip back. A clip that moves no node has none: a warning. 404 for an unknown node; 422 for a
   * turn below nodes with unequal scales. */
  root_motion?: string;
  /**
   * With `root_motion` or `in_place=true`: which parts of the motion are taken, separated by commas: translation
   * along the world's `x`, `y` and `z`, and `yaw`, the turn about y.
   * @default x,z,yaw
   */
  root_axes?: string;
  /**
   * Drops the root motion in place of telling it: the figure stays where it is at time 0. Without `root_motion` it
   * means `auto`. In `.csv` and `.bvh`, which have no place for `root`, root motion goes with this only.
   * @default false
   */
  in_place?: boolean;
  /**
   * First of evenly spaced times in seconds; needs `fps`.
   * @default 0
   */
  from?: number;
  /** Last of evenly spaced times in seconds, default the clip's end; needs `fps`. */
  to?: number;
  /** Number of evenly spaced times per second. Excludes `at`. */
  fps?: number;
  /**
   * Of clips kept as animations: the most degrees that a rotation may be off, at any time. Given this or
   * `tolerance_m`, every track that is neither STEP nor CUBICSPLINE gets as few LINEAR keys as that allows; else
   * tracks that glTF can hold keep their keys, Euler angles too, as quaternions and with further keys between them,
   * and only the others (`nlerp`, `squad`, axis-angle) are made of LINEAR keys, under this tolerance.
   * X-Tweend-Error tells what is left.
   * @default 0.1
   */
  tolerance?: number;
  /**
   * As `tolerance`, in metres: of translations, of scales as they move a point one metre away, of weights as they
   * are.
   * @default 0.001
   */
  tolerance_m?: number;
  /**
   * What becomes of skins and morph targets: kept with the surface, or, with one time, or at rest with `clip=none`
   * and no time, the control meshes are moved by them first, and the surface is that of the moved mesh. A baked
   * skinned mesh hangs on a root node of its own, for its points are where the world has them. OBJ holds neither
   * skins nor targets: there the meshes are always moved, at rest where no time is given.
   * @default keep
   */
  skin?: "keep" | "bake";
  /**
   * How many joints move a point of the answer. `all`: as many sets of four (JOINTS_0, JOINTS_1, …) as the file
   * has, at every level; the heaviest joints of each point, heaviest first. `4`: one set, which every viewer reads;
   * X-Tweend-Warning tells how many points of the file follow more. A point that subdivision makes may follow more
   * joints than there is room for: the heaviest stay, and their weights are scaled to a sum of 1. Baking
   * (`skin=bake`) always uses all.
   * @default all
   */
  influences?: "all" | "4";
  /**
   * `none`: only the node tree and the animation.
   * @default all
   */
  meshes?: "all" | "none";
  /**
   * How glTF holds what it draws. `quantized` (KHR_mesh_quantization): positions in 16 bits, which the matrices of
   * a skin undo, or a child node that is added for the mesh; normals and tangents in 8 bits; texture coordinates
   * and colours in 16 where they are from 0 to 1; weights in 8; each primitive has its own vertices, at most 65,534
   * of them, and 16-bit indices. Meshes that EXT_mesh_gpu_instancing shows, that have points or lines, or whose
   * weights KHR_animation_pointer moves keep positions as floats. `meshopt`: the same by EXT_meshopt_compression;
   * triangles may come in another order, unless `polygons=ngon`. Both leave out what `extras.tweend` says of a cage
   * at level 0 with `polygons=ngon`: a warning tells of creases, corners, holes, details, groups, seams between
   * equal values, values that no edge joins, points apart at one place, points that no edge joins and rules that
   * are lost. Its size takes as long as the GLB: `surface.json` computes what that will need too, and `HEAD` bears
   * no `Content-Length` until either has been asked for, and none of meshes that `skin=bake` moves. OBJ is the same
   * in every encoding.
   * @default float
   */
  encoding?: "float" | "quantized" | "meshopt";
  /**
   * `ngon`: in PLY the polygons themselves; in glTF triangles in the fan order of FB_ngon_encoding, which the
   * answer declares. The fan of a concave polygon starts at a corner from which it is right. A polygon without such
   * a corner is split into triangles, and a warning tells how many there are; at level 0 in floats `extras.tweend`
   * says which triangles are one polygon, and an upload joins them again. There it also has what else a cage is:
   * the points of its vertices, the order of faces, creases, corners, holes, groups, details and rules; and
   * `values`, which is there where a seam runs between equal values, as an upload would join these: for each such
   * attribute (`TEXCOORD_0`, `COLOR_0`, `_NAME`) an accessor with a number for each vertex, equal on one side of a
   * seam alone. `triangles` cuts every polygon by its shape. It holds what is drawn: an upload of it has none of
   * the rest, and at level 0 a warning tells what that is.
   * @default triangles
   */
  polygons?: "triangles" | "ngon";
  /**
   * The unit of the coordinates of `.stl`, `.ply` and `.3mf`, of which a metre of the model has so many; other
   * forms are in the model's unit and refuse it. Default: millimetres for STL and 3MF, metres for PLY.
   */
  unit?: "mm" | "cm" | "m" | "um" | "in" | "ft";
  /**
   * Multiplies the coordinates of `.stl`, `.ply` and `.3mf`, besides `unit`: `scale=0.001` for a model that was
   * made in millimetres.
   * @default 1
   */
  scale?: number;
  /**
   * `true`: `surface.json` tells of printability: of each shell (a set of faces that edges connect) whether it is
   * closed, its volume and area, those of the triangles as `surface.stl` has them, and open edges, with skins and
   * morph targets where `surface.stl` shows them: the sizes are those of `skin=bake`, without clips. That takes a
   * pass over all triangles. Other forms refuse it; STL, PLY and 3MF warn of shells that are not closed or inside
   * out.
   * @default false
   */
  shells?: boolean;
  /** Of `.bin`: name of the mesh whose points are wanted; a mesh without a name is `mesh_` and its index. Optional
   * if there is only one mesh. Other forms refuse it. */
  mesh?: string;
  /**
   * Of `.bin`: what rows have behind the position. Texture coordinates are those of the first set, v down. Other
   * forms refuse it.
   * @default positions
   */
  with?: "positions" | "normals" | "uvs" | "normals,uvs";
  /**
   * `false` leaves out what is modelled onto the levels of the meshes. It is of the scheme that it was modelled by,
   * never of `bilinear`, and not for `boundary=open` where a mesh has a border, whose points that takes away: 422
   * where these do not go together.
   * @default true
   */
  details?: boolean;
  /**
   * `1` sends `Content-Disposition: attachment` with the model's name, so that browsers save the answer.
   * @default 0
   */
  download?: "0" | "1";
}
export interface PoseOptions {
  /** A clip's name, default the first; `{model id}/{name}` borrows a clip of another stored model, matching nodes
   * by name. Several names, separated by commas (at most 256), play together; if two clips move the same path of a
   * node, the later one in the list wins. `none` is the rest pose. A value that equals a clip's whole name, even
   * with commas or `none`, means that clip. */
  clip?: string;
  /**
   * Of borrowed clips. `none`: matched by the names of nodes, values as they are. `auto`: carried over to this
   * model's skeleton. Bones are matched by `map`, then by humanoid maps (VRM), equal names, and the names that
   * usual rigs have (Mixamo, CMU and other BVH, Rigify and Blender, Unreal's mannequin, MakeHuman, Ready Player Me,
   * Unity, VRoid, Biped, SMPL, DAZ, Character Creator, Auto-Rig Pro, AdvancedSkeleton, Perception Neuron, Roblox
   * R15, Motive, Kinect, Xsens, Biovision, Rokoko, ARKit, VRChat, MikuMikuDance). Rotations go over relative to
   * each rest pose; limbs that rest otherwise are aligned from joint to joint, so that the hand points where the
   * source's points; a source that rests with its legs folded up beside the trunk (LaFAN1) counts as resting as it
   * stands straightest in the clip, which X-Tweend-Warning tells; bones in between share the motion, or are taken
   * into it; a spine that bends at other joints swings as a whole, so that neck and shoulders are where the clip
   * has them, and its first joint moves by what turning cannot reach; hips move by the ratio of leg lengths, and
   * between humanoid maps by that of hip heights. Expressions and gaze of a VRMA go over to a VRM's face either
   * way. Bones that the clip moves and that have no counterpart are a warning with the first of their names. 422
   * where fewer than half of the bones match, of those that the clip moves or of the model's where these are fewer,
   * and without a skeleton. Own clips stay as they are; where no other is asked for, X-Tweend-Warning tells that
   * `auto` does nothing.
   * @default none
   */
  retarget?: "none" | "auto";
  /** With `retarget=auto`: a JSON object of pairs of bones, `{"source node": "target node"}`, that count before all
   * others; null for a bone of the source that shall move nothing. At most 1,024 pairs. An unknown name, or a
   * target named twice, is 422. */
  map?: string | {
    [key: string]: string | null;
  };
  /**
   * With `retarget=auto`, `hold`: while a foot of the clip's own figure touches the ground, this model's foot
   * stands still, as seen from above. The leg bends and swings for it (inverse kinematics of two bones); the foot
   * keeps its height and rotation, and comes and goes within 0.15 s. Where a leg is too short for it, the hips go
   * down softly within 0.3 s, with all that is above them, by up to a tenth of the leg's length. A warning where no
   * foot could be held.
   */
  feet?: "hold";
  /** The name of a node whose motion moves the whole figure, or `auto`: the topmost node that the clip translates,
   * else turns, and of several the one with most nodes below; tracks whose value never changes, as of exporters
   * that bake, do not count. The part of its motion in the world that `root_axes` names, counted from time 0, is
   * taken out of the poses, and told beside them: as `root` of each pose, and in glTF as tracks of the skeleton's
   * topmost node, above which stands a new node `root` where the motion is its own. The motion in front of the
   * poses gives the clip back. A clip that moves no node has none: a warning. 404 for an unknown node; 422 for a
   * turn below nodes with unequal scales. */
  root_motion?: string;
  /**
   * With `root_motion` or `in_place=true`: which parts of the motion are taken, separated by commas: translation
   * along the world's `x`, `y` and `z`, and `yaw`, the turn about y.
   * @default x,z,yaw
   */
  root_axes?: string;
  /**
   * Drops the root motion in place of telling it: the figure stays where it is at time 0. Without `root_motion` it
   * means `auto`. In `.csv` and `.bvh`, which have no place for `root`, root motion goes with this only.
   * @default false
   */
  in_place?: boolean;
  /** Times in seconds, separated by commas, in any order. Without `at` and `fps`: 0. */
  at?: string | number | number[];
  /**
   * First of evenly spaced times in seconds; needs `fps`.
   * @default 0
   */
  from?: number;
  /** Last of evenly spaced times in seconds, default the clip's end; needs `fps`. */
  to?: number;
  /** Number of evenly spaced times per second. Excludes `at`. */
  fps?: number;
  /**
   * Relative to the parent, or in the model's space. In world space only matrices can hold shear, and a number
   * beyond 3.4e38, as scales above a node multiply to, is `null` (in `pose.bin` an infinity).
   * @default local
   */
  space?: "local" | "world";
  /**
   * Form of a pose. Matrices are column-major.
   * @default trs
   */
  as?: "trs" | "matrix" | "euler" | "axis-angle";
  /**
   * With as=euler. XYZ means R = Rx Ry Rz; triples are always the angles about x, y, z. In a sequence of times,
   * each sample is the triple nearest to the one before.
   * @default XYZ
   */
  order?: "XYZ" | "XZY" | "YXZ" | "YZX" | "ZXY" | "ZYX";
  /**
   * With as=euler and as=axis-angle.
   * @default radians
   */
  unit?: "radians" | "degrees";
  /** Names of nodes, separated by commas; default all. The answer keeps the file's order. A name shared by several
   * nodes selects all of them. A value that equals a node's whole name, even with commas, means that node. */
  nodes?: string | string[];
  /**
   * Interpolation of every rotation track; default: as stored. `linear` and `slerp` are the same. Keys are
   * converted to quaternions first, except with `euler`, which keeps Euler keys and converts others to XYZ triples.
   * `cubicspline` needs tangents in every rotation track.
   */
  interpolation?: "step" | "linear" | "cubicspline" | "slerp" | "nlerp" | "squad" | "euler";
  /**
   * How times outside the clip are mapped into it.
   * @default clamp
   */
  loop?: "clamp" | "repeat" | "pingpong";
  /**
   * With as=matrix: joint matrices (world x inverse bind, column-major) of all skins, one skin after the other. The
   * answer's `nodes` names the joints in that order, and `skins` says where each skin begins. All joints are
   * included, so the parameter `nodes` is an error here.
   * @default false
   */
  skinning?: boolean;
}
export interface LiveOptions {
  /** A clip's name, default the first; `{model id}/{name}` borrows a clip of another stored model, matching nodes
   * by name. Several names, separated by commas (at most 256), play together; if two clips move the same path of a
   * node, the later one in the list wins. `none` is the rest pose. A value that equals a clip's whole name, even
   * with commas or `none`, means that clip. */
  clip?: string;
  /**
   * Playback speed; a negative speed plays backwards, from the clip's end unless `from` is given.
   * @default 1
   */
  speed?: number;
  /**
   * Of borrowed clips. `none`: matched by the names of nodes, values as they are. `auto`: carried over to this
   * model's skeleton. Bones are matched by `map`, then by humanoid maps (VRM), equal names, and the names that
   * usual rigs have (Mixamo, CMU and other BVH, Rigify and Blender, Unreal's mannequin, MakeHuman, Ready Player Me,
   * Unity, VRoid, Biped, SMPL, DAZ, Character Creator, Auto-Rig Pro, AdvancedSkeleton, Perception Neuron, Roblox
   * R15, Motive, Kinect, Xsens, Biovision, Rokoko, ARKit, VRChat, MikuMikuDance). Rotations go over relative to
   * each rest pose; limbs that rest otherwise are aligned from joint to joint, so that the hand points where the
   * source's points; a source that rests with its legs folded up beside the trunk (LaFAN1) counts as resting as it
   * stands straightest in the clip, which X-Tweend-Warning tells; bones in between share the motion, or are taken
   * into it; a spine that bends at other joints swings as a whole, so that neck and shoulders are where the clip
   * has them, and its first joint moves by what turning cannot reach; hips move by the ratio of leg lengths, and
   * between humanoid maps by that of hip heights. Expressions and gaze of a VRMA go over to a VRM's face either
   * way. Bones that the clip moves and that have no counterpart are a warning with the first of their names. 422
   * where fewer than half of the bones match, of those that the clip moves or of the model's where these are fewer,
   * and without a skeleton. Own clips stay as they are; where no other is asked for, X-Tweend-Warning tells that
   * `auto` does nothing.
   * @default none
   */
  retarget?: "none" | "auto";
  /** With `retarget=auto`: a JSON object of pairs of bones, `{"source node": "target node"}`, that count before all
   * others; null for a bone of the source that shall move nothing. At most 1,024 pairs. An unknown name, or a
   * target named twice, is 422. */
  map?: string | {
    [key: string]: string | null;
  };
  /**
   * With `retarget=auto`, `hold`: while a foot of the clip's own figure touches the ground, this model's foot
   * stands still, as seen from above. The leg bends and swings for it (inverse kinematics of two bones); the foot
   * keeps its height and rotation, and comes and goes within 0.15 s. Where a leg is too short for it, the hips go
   * down softly within 0.3 s, with all that is above them, by up to a tenth of the leg's length. A warning where no
   * foot could be held.
   */
  feet?: "hold";
  /** The name of a node whose motion moves the whole figure, or `auto`: the topmost node that the clip translates,
   * else turns, and of several the one with most nodes below; tracks whose value never changes, as of exporters
   * that bake, do not count. The part of its motion in the world that `root_axes` names, counted from time 0, is
   * taken out of the poses, and told beside them: as `root` of each pose, and in glTF as tracks of the skeleton's
   * topmost node, above which stands a new node `root` where the motion is its own. The motion in front of the
   * poses gives the clip back. A clip that moves no node has none: a warning. 404 for an unknown node; 422 for a
   * turn below nodes with unequal scales. */
  root_motion?: string;
  /**
   * With `root_motion` or `in_place=true`: which parts of the motion are taken, separated by commas: translation
   * along the world's `x`, `y` and `z`, and `yaw`, the turn about y.
   * @default x,z,yaw
   */
  root_axes?: string;
  /**
   * Drops the root motion in place of telling it: the figure stays where it is at time 0. Without `root_motion` it
   * means `auto`. In `.csv` and `.bvh`, which have no place for `root`, root motion goes with this only.
   * @default false
   */
  in_place?: boolean;
  /**
   * Frames a second.
   * @default 30
   */
  fps?: number;
  /**
   * Time in the clip of frame 0, in seconds.
   * @default 0
   */
  from?: number;
  /** Unix time in milliseconds at which frame 0 is due; frame n is due n x 1000 / `fps` later. All clients with the
   * same start see the same frame at the same time. Default: when the stream begins. */
  start?: number;
  /**
   * How times outside the clip are mapped into it.
   * @default clamp
   */
  loop?: "clamp" | "repeat" | "pingpong";
  /**
   * Relative to the parent, or in the model's space. In world space only matrices can hold shear, and a number
   * beyond 3.4e38, as scales above a node multiply to, is `null` (in `pose.bin` an infinity).
   * @default local
   */
  space?: "local" | "world";
  /**
   * Form of a pose. Matrices are column-major.
   * @default trs
   */
  as?: "trs" | "matrix" | "euler" | "axis-angle";
  /**
   * With as=euler. XYZ means R = Rx Ry Rz; triples are always the angles about x, y, z. In a sequence of times,
   * each sample is the triple nearest to the one before.
   * @default XYZ
   */
  order?: "XYZ" | "XZY" | "YXZ" | "YZX" | "ZXY" | "ZYX";
  /**
   * With as=euler and as=axis-angle.
   * @default radians
   */
  unit?: "radians" | "degrees";
  /** Names of nodes, separated by commas; default all. The answer keeps the file's order. A name shared by several
   * nodes selects all of them. A value that equals a node's whole name, even with commas, means that node. */
  nodes?: string | string[];
  /**
   * Interpolation of every rotation track; default: as stored. `linear` and `slerp` are the same. Keys are
   * converted to quaternions first, except with `euler`, which keeps Euler keys and converts others to XYZ triples.
   * `cubicspline` needs tangents in every rotation track.
   */
  interpolation?: "step" | "linear" | "cubicspline" | "slerp" | "nlerp" | "squad" | "euler";
  /**
   * With as=matrix: joint matrices (world x inverse bind, column-major) of all skins, one skin after the other. The
   * answer's `nodes` names the joints in that order, and `skins` says where each skin begins. All joints are
   * included, so the parameter `nodes` is an error here.
   * @default false
   */
  skinning?: boolean;
}
export interface TracksOptions {
  /** The name of one of the model's own clips, default the first, or `{model id}/{name}`, a clip of another stored
   * model as `pose` plays it here: by node name, or carried over with `retarget=auto`. Of a mixed clip, keys are
   * inspected that follow it within 0.05 degrees and 0.0001 m. */
  clip?: string;
  /** With `retarget=auto`, `hold`: see `feet` of poses; what of the slide is left, the report tells. Else: Names of
   * the nodes that are feet, separated by commas; a name that several nodes have means all of them. Default: those
   * of the humanoid map; without one, those that usual names tell (see `retarget`); without these, nodes with
   * `foot` in their names, else those with `ankle`. */
  feet?: string | string[];
  /**
   * Of borrowed clips. `none`: matched by the names of nodes, values as they are. `auto`: carried over to this
   * model's skeleton. Bones are matched by `map`, then by humanoid maps (VRM), equal names, and the names that
   * usual rigs have (Mixamo, CMU and other BVH, Rigify and Blender, Unreal's mannequin, MakeHuman, Ready Player Me,
   * Unity, VRoid, Biped, SMPL, DAZ, Character Creator, Auto-Rig Pro, AdvancedSkeleton, Perception Neuron, Roblox
   * R15, Motive, Kinect, Xsens, Biovision, Rokoko, ARKit, VRChat, MikuMikuDance). Rotations go over relative to
   * each rest pose; limbs that rest otherwise are aligned from joint to joint, so that the hand points where the
   * source's points; a source that rests with its legs folded up beside the trunk (LaFAN1) counts as resting as it
   * stands straightest in the clip, which X-Tweend-Warning tells; bones in between share the motion, or are taken
   * into it; a spine that bends at other joints swings as a whole, so that neck and shoulders are where the clip
   * has them, and its first joint moves by what turning cannot reach; hips move by the ratio of leg lengths, and
   * between humanoid maps by that of hip heights. Expressions and gaze of a VRMA go over to a VRM's face either
   * way. Bones that the clip moves and that have no counterpart are a warning with the first of their names. 422
   * where fewer than half of the bones match, of those that the clip moves or of the model's where these are fewer,
   * and without a skeleton. Own clips stay as they are; where no other is asked for, X-Tweend-Warning tells that
   * `auto` does nothing.
   * @default none
   */
  retarget?: "none" | "auto";
  /** With `retarget=auto`: a JSON object of pairs of bones, `{"source node": "target node"}`, that count before all
   * others; null for a bone of the source that shall move nothing. At most 1,024 pairs. An unknown name, or a
   * target named twice, is 422. */
  map?: string | {
    [key: string]: string | null;
  };
  /** The name of a node whose motion moves the whole figure, or `auto`: the topmost node that the clip translates,
   * else turns, and of several the one with most nodes below; tracks whose value never changes, as of exporters
   * that bake, do not count. The part of its motion in the world that `root_axes` names, counted from time 0, is
   * taken out of the poses, and told beside them: as `root` of each pose, and in glTF as tracks of the skeleton's
   * topmost node, above which stands a new node `root` where the motion is its own. The motion in front of the
   * poses gives the clip back. A clip that moves no node has none: a warning. 404 for an unknown node; 422 for a
   * turn below nodes with unequal scales. */
  root_motion?: string;
  /**
   * With `root_motion` or `in_place=true`: which parts of the motion are taken, separated by commas: translation
   * along the world's `x`, `y` and `z`, and `yaw`, the turn about y.
   * @default x,z,yaw
   */
  root_axes?: string;
  /**
   * Drops the root motion in place of telling it: the figure stays where it is at time 0. Without `root_motion` it
   * means `auto`. In `.csv` and `.bvh`, which have no place for `root`, root motion goes with this only.
   * @default false
   */
  in_place?: boolean;
}
