// Types of tweend.js, the client of tweend.

/** A model's id, its description, or its entry in the list. */
export type ModelId = string | { id: string };
/** The content of an upload. Several files (a glTF and the files that it names) are stored as one GLB. */
export type ModelSource = string | Blob | ArrayBuffer | ArrayBufferView<ArrayBuffer> | readonly File[];

export type SurfaceForm = 'glb' | 'gltf' | 'obj' | 'json';
export type PoseForm = 'json' | 'ndjson' | 'bin' | 'csv';

/** Options passed on to `fetch`. */
export interface Abortable {
  signal?: AbortSignal;
}

export interface UploadOptions extends Abortable {
  /** The model's name; default: the file's name. */
  name?: string;
  /** Media type; default: detected from the bytes. */
  type?: string;
  /** Called with the bytes sent so far and in all. Only in browsers, and not if the client was created with a `fetch`. */
  onProgress?(sent: number, total: number): void;
}

/** An error answer. Without an answer, `fetch`'s own error is thrown. */
export class TweendError extends Error {
  readonly status: number;
  readonly title?: string;
  readonly detail?: string;
  /** Mistakes in the document that was sent, with JSON pointers. */
  readonly errors: readonly { pointer: string; detail: string }[];
  /** The line in the OBJ that was sent, from 1. */
  readonly line?: number;
  readonly requestId?: string;
  /** Seconds to wait before a retry. */
  readonly retryAfter?: number;
  /** The whole problem document. */
  readonly problem: Partial<Problem>;
}

export class Tweend {
  /** base: URL of the daemon, including a path prefix; default: where this module was loaded from. */
  constructor(base?: string | URL, options?: { key?: string; fetch?: typeof fetch });
  /** Ends with a slash. */
  readonly base: string;
  /** An API key, sent with each request. */
  key?: string;

  /** Fetches a path below `base`, or a URL. Throws a TweendError for an error answer. */
  request(path: string, init?: RequestInit): Promise<Response>;
  /** The URL of a path below `base`. */
  url(path: string): string;
  /** Signs the URL of a GET, so that it needs no key for `seconds`. If this client has no key, returns the absolute URL unsigned. */
  sign(url: string, seconds?: number): Promise<string>;

  upload(source: ModelSource, options?: UploadOptions): Promise<Model>;
  describe(model: ModelId, init?: Abortable): Promise<Model>;
  /** Makes a new model by editing a mesh of this one. `mesh` may be left out if the model has one mesh. */
  edit(model: ModelId, edits: Edit[], options?: { mesh?: string; name?: string } & Pick<SurfaceOptions, "quads"> & Abortable): Promise<Model>;
  /** Makes a new model whose surface at `level` has these points: x y z each, in the order of `points()`. */
  sculpt(model: ModelId, points: Iterable<number>, options: { level: number; mesh?: string; name?: string } & Pick<SurfaceOptions, "quads"> & Abortable): Promise<Model>;
  /** Makes a new model by replacing a refined mesh by its cage; what the cage's surface lacks becomes detail. */
  coarsen(
    model: ModelId,
    options?: { mesh?: string; levels?: number | "max"; name?: string } & Pick<SurfaceOptions, "scheme" | "boundary" | "quads"> & Abortable,
  ): Promise<Model>;
  /** All models, by id, fetched page by page; `limit`: models per page. */
  list(options?: ListOptions & Abortable): AsyncGenerator<Listed, void, undefined>;
  remove(model: ModelId, init?: Abortable): Promise<void>;
  sourceUrl(model: ModelId, options?: SourceOptions): string;

  surfaceUrl(model: ModelId, options?: SurfaceOptions, form?: SurfaceForm): string;
  surface(model: ModelId, options?: SurfaceOptions, form?: SurfaceForm, init?: Abortable): Promise<Response>;
  /** The points of a surface, x y z each, in the order of its OBJ. */
  points(model: ModelId, options?: SurfaceOptions, init?: Abortable): Promise<Float32Array>;
  surfaceCounts(model: ModelId, options?: SurfaceOptions, init?: Abortable): Promise<SurfaceCounts>;

  poseUrl(model: ModelId, options?: PoseOptions, form?: PoseForm): string;
  pose(model: ModelId, options?: PoseOptions, init?: Abortable): Promise<Poses>;
  /** Binary poses, row by row as they arrive. */
  poseStream(model: ModelId, options?: PoseOptions, init?: Abortable): Promise<PoseStream>;
  /** Binary poses, all at once. */
  poseTable(model: ModelId, options?: PoseOptions, init?: Abortable): Promise<PoseTable>;
  tracks(model: ModelId, options?: TracksOptions, init?: Abortable): Promise<Tracks>;
  rotations(request: RotationsRequest, init?: Abortable): Promise<Rotations>;

  /** Fetches a whole clip and returns a player of it. */
  play(model: ModelId, objects: Objects, options?: PlayOptions): Promise<Player>;
  liveUrl(model: ModelId, options?: LiveOptions): string;
  /** Returns a player of the live stream when the first frame has arrived. */
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

export interface PlayOptions extends PlayerSettings, Pick<PoseOptions, 'clip' | 'nodes' | 'interpolation'>, Abortable {
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
  delay: number;
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
  /** `urn:tweend:problem:` and a name for each status. */
  type: string;
  title: string;
  status: number;
  /** What is wrong, for a person; begins with the pointer or the line where there is one. */
  detail: string;
  /** The request's id. */
  instance: string;
  errors?: {
    /** RFC 6901 pointer into the document that was sent, or into the glTF JSON of a GLB. */
    pointer: string;
    detail: string;
  }[];
  /** Of an OBJ, from 1. */
  line?: number;
  /** Of that line, in characters from 1, where a word is no number or no corner. */
  column?: number;
  /** What the surface would have had. */
  predicted?: {
    vertices: number;
    edges: number;
    faces: number;
    /** Of the answer, where it is known. */
    bytes?: number;
  };
  /** Types or codings, of 406 and 415. */
  supported?: string[];
}
export interface Listed {
  id: string;
  name: string | null;
  format: Format;
  bytes: number;
}
export type Format = "obj" | "tweend" | "gltf" | "glb" | "stl" | "ply";
export interface ModelList {
  models: Listed[];
  /** URL of the next page. */
  next: string | null;
}
export interface MeshFacts {
  name: string | null;
  /** Points that a face uses. */
  vertices: number;
  edges: number;
  faces: number;
  /** Number of faces by their corners. */
  face_sizes: {
    [key: string]: number;
  };
  /** Edges of one face. */
  boundary_edges: number;
  /** Closed ways round the border; two that meet in a mere point are two. */
  boundary_loops: number;
  /** Edges of three faces or more, and of two that run along it in the same direction: one of them is flipped. */
  nonmanifold_edges: number;
  /** Points whose faces are not one fan: the ends of such edges, and points in which alone faces meet. */
  nonmanifold_vertices: number;
  /** The first 64 places of each kind, by point indices; only where there are any. */
  nonmanifold?: {
    edges: number[][];
    vertices: number[];
  };
  /** Vertices of the file that became one with another point (`weld`). */
  welded_points: number;
  /** Borders that lie on another border, by position: seams that are open. */
  seam_edges: number;
  /** Where two faces run along each other in the same direction, so that one of them is wound the other way round.
   * Where the two have points of their own the surface is open there, else it has a crease. */
  reversed_edges: number;
  /** The first 64 of them, by their points; left out when there are none. */
  reversed?: number[][];
  /** Interior valence other than 4, border valence other than 3 (corners: 2); not of vertices that are not
   * manifold. */
  extraordinary_vertices: number;
  /** Number of extraordinary vertices by valence, the number of their edges. */
  extraordinary_valences: {
    [key: string]: number;
  };
  /** Pieces that share no point. */
  components: number;
  /** Vertices - edges + faces. */
  euler_characteristic: number;
  bounds: {
    min: number[];
    max: number[];
  };
  unused_points: number;
  /** Edges that a tag makes sharp. */
  creases: number;
  /** Vertices that a tag makes sharp. */
  corners: number;
  /** Faces that a tag leaves out of surfaces. */
  holes: number;
  /** How many edges the values of `creases` find. */
  hard_edges: {
    tags: number;
    normals: number;
    angle_30: number;
    auto: number;
  };
  /** How many quads `quads=auto` makes of pairs of a glTF's triangles. */
  paired_quads: number;
  /** Different sets of named groups that faces are in. */
  group_count: number;
  /** The first 64 of them, in the order of the file. */
  groups: {
    names: string[];
    faces: number;
  }[];
  uv_sets: number;
  morph_targets: number;
  /** Levels that something is modelled onto. */
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
    /** One without a name is `node_3` by its index. */
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
      /** Where the file has one; column-major. */
      matrix?: number[];
    };
  }[];
  skins: {
    name: string | null;
    skeleton: string | null;
    joints: string[];
  }[];
  clips: {
    /** One without a name is `clip_0` by its index. */
    name: string;
    /** Seconds. */
    duration: number;
    tracks: number;
    /** Of all tracks. */
    keys: number;
  }[];
  /** Of an answer to edits: what those made that bear a name, as indices in the new model. */
  made?: {
    [key: string]: {
      faces: number[];
      vertices: number[];
    };
  };
  /** Of an answer to coarsen: steps taken back. */
  levels?: number;
  warnings: string[];
}
export interface SurfaceCounts {
  level: number;
  /** Welded points, not the splits that glTF needs. */
  vertices: number;
  edges: number;
  faces: number;
  /** Of the GLB under the same options; null with `encoding=meshopt` until such a GLB has been made. */
  bytes: number | null;
  meshes: {
    name: string | null;
    level: number;
    /** Welded points, not the splits that glTF needs. */
    vertices: number;
    edges: number;
    faces: number;
    /** Of a GLB with this mesh alone, without materials. */
    bytes: number | null;
  }[];
}
/** One entry a node in the order of `nodes`. */
export interface Pose {
  /** Seconds, as asked for. */
  t: number;
  /** as=trs: x y z w. */
  rotation?: number[][];
  /** as=euler. */
  euler?: number[][];
  /** as=axis-angle: x y z angle. */
  axis_angle?: number[][];
  /** as=matrix: column-major; in place of all others. */
  matrix?: number[][];
  translation?: number[][];
  scale?: number[][];
}
export interface Poses {
  /** Several names with commas between them where several clips move together. null: none does, the model rests. */
  clip: string | null;
  duration: number;
  space: "local" | "world";
  as: "trs" | "matrix" | "euler" | "axis-angle";
  /** With as=euler. */
  order?: string;
  /** With as=euler and as=axis-angle. */
  unit?: string;
  /** Nodes of a borrowed clip that the model does not have. */
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
  times: number[];
}
/**
 * XYZ: R = Rx Ry Rz (intrinsic).
 * @default XYZ
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
    /** Nine numbers, or sixteen with a last row and column of 0 0 0 1; column-major. Columns may be off unit length
     * and right angles by 0.001. */
    matrix?: number[];
  }[];
  /**
   * Of all angles, in the request and in the answer.
   * @default radians
   */
  unit?: "radians" | "degrees";
  /**
   * @default quaternion
   */
  as?: "quaternion" | "axis-angle" | "euler" | "matrix";
  order?: EulerOrder;
  /** Turned by each rotation: points times rotations are at most 100,000. */
  points?: number[][];
  /** Where the short way from the first rotation (0) to the last (1) is told; outside it goes on. At most
   * `--max-times`. */
  slerp?: number[];
}
/** In the form that `as` names: x y z w; x y z angle, the angle from 0 to half a turn; angles about x, y, z, at
 * gimbal lock 0 for the order's last axis; nine numbers, column-major. */
export type Rotation = number[];
export interface Rotations {
  rotations: {
    quaternion?: Rotation;
    axis_angle?: Rotation;
    euler?: Rotation;
    matrix?: Rotation;
    inverse: Rotation;
    /** The request's points, turned; only where it names some. */
    points?: number[][];
    /** For each Euler order |cos| of the middle angle: 1 is farthest from gimbal lock, 0 is lock. */
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
    /** Of the keys, in seconds. */
    times: number[];
    /** Time of the first key. */
    start: number;
    /** From the first key to the last. */
    duration: number;
    /** Travelled along the path. */
    total_degrees: number;
    /** The most from one key to the next. */
    largest_step_degrees: number;
    /** From which key. */
    largest_step_key: number;
    peak_degrees_per_second: number;
    peak_time: number;
    /** Keys on the other side than the key before: q and -q are one rotation. */
    sign_flips: number;
    non_unit_keys: number;
    /**
     * Always 0: two keys at one time are refused when the model is stored, with their place.
     * @constant
     */
    duplicate_times: 0;
    /** Steps of exactly 180 degrees. */
    half_turns: number;
    /** Steps that quaternions would shorten. */
    steps_over_180: number;
    /** Euler keys with an angle more than 180 degrees from the key before's. */
    euler_wraps: number;
    /** Euler tracks only. */
    slerp_stray?: {
      /** The most that interpolating angle by angle departs from slerp between the same keys. */
      degrees: number;
      time: number;
    };
    /** In the track's own order; XYZ where it has none. */
    gimbal: {
      order: string;
      time: number;
      /** Least |cos| of the order's middle angle along the path: 1 is farthest from lock, 0 is lock. */
      cos_middle: number;
      /** 1 / cos_middle; null at lock. */
      amplification: number | null;
      /**
       * The axis that at lock turns as the order's first does.
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
    /** The one whose worst place is farthest from lock. */
    best_order: string;
    warnings: string[];
  }[];
  other_tracks: {
    node: string;
    path: "translation" | "scale" | "weights";
    interpolation: "step" | "linear" | "cubicspline";
    keys: number;
    /** Of the keys, in seconds. */
    times: number[];
  }[];
}
/** A cage centred on the origin, closed but for `grid` and open caps, faces outward, points by y, then z, then x.
 * Its UVs are those of three.js. What all shapes of a document make is limited by `--max-faces` and `--max-memory`.
 * */
export type Shape = {
  /** @constant */
  kind: "grid";
  /**
   * Along x and z.
   * @default [
   *       1,
   *       1
   *     ]
   */
  size?: number[];
  /**
   * @default [
   *       1,
   *       1
   *     ]
   */
  segments?: number[];
} | {
  /** @constant */
  kind: "box";
  /**
   * @default [
   *       1,
   *       1,
   *       1
   *     ]
   */
  size?: number[];
  /**
   * @default [
   *       1,
   *       1,
   *       1
   *     ]
   */
  segments?: number[];
} | {
  /** @constant */
  kind: "quad_sphere";
  /** @default 1 */
  radius?: number;
  /** @default 16 */
  segments?: number;
} | {
  /** @constant */
  kind: "uv_sphere";
  /** @default 1 */
  radius?: number;
  /** @default 16 */
  segments?: number;
  /**
   * Bands from pole to pole.
   * @default 8
   */
  rings?: number;
} | {
  /** @constant */
  kind: "icosphere";
  /** @default 1 */
  radius?: number;
  /** @default 1 */
  level?: number;
} | {
  /** @constant */
  kind: "ellipsoid";
  /**
   * @default [
   *       1,
   *       1,
   *       1
   *     ]
   */
  radii?: number[];
  /** @default 16 */
  segments?: number;
} | {
  /** @constant */
  kind: "cylinder";
  /** @default 1 */
  radius?: number;
  /** @default 1 */
  height?: number;
  /** @default 16 */
  segments?: number;
  /**
   * Bands from top to bottom.
   * @default 1
   */
  rings?: number;
  /**
   * @default ngon
   */
  caps?: "ngon" | "fan" | "none";
} | {
  /** @constant */
  kind: "cone";
  /** @default 1 */
  radius?: number;
  /** @default 1 */
  height?: number;
  /** @default 16 */
  segments?: number;
  /**
   * Bands from top to bottom.
   * @default 1
   */
  rings?: number;
  /**
   * @default ngon
   */
  caps?: "ngon" | "fan" | "none";
} | {
  /** @constant */
  kind: "torus";
  /**
   * To the middle of the tube.
   * @default 1
   */
  radius?: number;
  /**
   * Radius of the tube, less than the other.
   * @default 0.4
   */
  tube?: number;
  /**
   * About the y axis.
   * @default 16
   */
  segments?: number;
  /**
   * About the tube.
   * @default 8
   */
  sides?: number;
};
/** Empty is an error, unless the edit is `optional`. */
export type FaceSelection = number[] | "all" | {
  group: string;
} | {
  /** Its index or name. */
  material: number | string;
} | {
  facing: number[];
  /**
   * Degrees.
   * @default 45
   */
  within?: number;
} | {
  inside: {
    min: number[];
    max: number[];
  };
} | {
  made: string;
};
/** Empty is an error, unless the edit is `optional`. */
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
/** Empty is an error, unless the edit is `optional`. */
export type VertexSelection = number[] | "all" | {
  inside: {
    min: number[];
    max: number[];
  };
} | {
  made: string;
};
/** Its indices are those of the mesh that it finds. New faces and vertices come after those that stay. `name` names
 * what it makes for later edits. Lengths are in the model's unit, angles in degrees. */
export type Edit = {
  /** @constant */
  edit: "extrude";
  faces: FaceSelection;
  /** Along the normals. */
  distance?: number;
  /** In place of a distance. */
  by?: number[];
  /** @default false */
  individual?: boolean;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "inset";
  faces: FaceSelection;
  amount: number;
  /** @default false */
  individual?: boolean;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "loop_cut";
  edge: number[];
  /** @default 1 */
  cuts?: number;
  /** One for each cut, ascending, between 0 and 1 from the edge's first vertex to its second; else evenly. */
  at?: number[];
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "subdivide";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  /** @default 1 */
  cuts?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "delete";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "merge";
  vertices: VertexSelection;
  /** Of those that become one with another; else all become one. */
  distance?: number;
  /** Where all become one; else at their mean. */
  to?: number[];
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "fill";
  /** An edge of the hole; else every hole. */
  border?: number[];
  max_edges?: number;
  /**
   * `triangles`: of the least area. `fair`: as large as those round the hole, and bent as the mesh is.
   * @default ngon
   */
  method?: "ngon" | "triangles" | "fair";
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "mirror";
  axis: "x" | "y" | "z";
  /**
   * Vertices nearer to the plane are on it, and one with their image; negative or `false`: none. `true`: the
   * default.
   * @default 0.000001
   */
  weld?: number | boolean;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "move";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  by: number[];
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "rotate";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  axis: ("x" | "y" | "z") | number[];
  degrees: number;
  /** Else the mean of the vertices. */
  about?: number[];
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "scale";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  by: number | number[];
  /** Else the mean of the vertices. */
  about?: number[];
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "crease";
  edges: EdgeSelection;
  /**
   * 10 is infinite; 0 takes the tag away.
   * @default 10
   */
  sharpness?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "corner";
  vertices: VertexSelection;
  /** @default 10 */
  sharpness?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "hole";
  faces: FaceSelection;
  /**
   * 0 makes a face of it again.
   * @default 10
   */
  sharpness?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  edit: "flip" | "orient" | "triangulate" | "quads";
  faces?: FaceSelection;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "weld";
  /** @default 0 */
  distance?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "drop_pieces";
  faces: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "despike";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  /** @default 2 */
  factor?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
} | {
  /** @constant */
  edit: "smooth";
  faces?: FaceSelection;
  edges?: EdgeSelection;
  vertices?: VertexSelection;
  /**
   * @default taubin
   */
  method?: "taubin" | "laplacian";
  /** @default 10 */
  iterations?: number;
  name?: string;
  /** @default false */
  optional?: boolean;
};
export interface EditsRequest {
  /** Its name; may be left out where there is one mesh. */
  mesh?: string;
  edits: Edit[];
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
   * Of a GET here, absolute or from the path on.
   * @example /v1/models
   */
  url: string;
  /** @default 3600 */
  seconds?: number;
}
export interface SignedUrl {
  url: string;
}
export interface ListOptions {
  /**
   * Models on a page.
   * @default 100
   */
  limit?: number;
  /** Models with greater ids; `next` of a page names the following one. */
  after?: string;
}
export interface SourceOptions {
  /**
   * `1`: `Content-Disposition` is `attachment`, so that browsers save the answer, by the model's name.
   * @default 0
   */
  download?: "0" | "1";
}
export interface SurfaceOptions {
  /**
   * Subdivision steps, up to the configured limit (10); 0 is the cage.
   * @default 1
   */
  level?: number;
  /**
   * Rules of subdivision; `loop` takes triangles only.
   * @default catmull-clark
   */
  scheme?: "catmull-clark" | "loop" | "bilinear";
  /**
   * Rule at borders: OpenSubdiv's three, or `open`: new points only where every parent exists, so that the surface
   * shrinks from the mesh's border; holes do not count as one. Wins over a tag of the file.
   * @default edge-and-corner
   */
  boundary?: "edge-and-corner" | "edge-only" | "none" | "open";
  /**
   * OpenSubdiv's face-varying linear interpolation rule. Wins over a tag of the file.
   * @default corners-only
   */
  uv?: "corners-only" | "none" | "corners-plus1" | "corners-plus2" | "boundaries" | "all";
  /**
   * How sharpness decays. Wins over a tag of the file.
   * @default uniform
   */
  creasing?: "uniform" | "chaikin";
  /**
   * Which edges are creases. `tags`: those that the file tags, nothing else. The next three add to them; an edge
   * that the file tags keeps its own sharpness. `normals`: edges of two faces whose normals in the file differ at
   * an end by over half a degree, and where the file gives none, edges between OBJ's smoothing groups or in `s
   * off`. `angle:DEGREES` (0 to 180): edges at which the faces turn by more, as in `angle:30`. `auto`: `normals` in
   * pieces (faces that hang together by points) that have smooth edges too; in pieces that are flat-shaded all
   * over, or of which the file says nothing, edges bent by more than 50 degrees. `none`: no creases and no sharp
   * vertices. Borders stay as `boundary` says. The description counts the edges as `hard_edges`.
   * @default tags
   */
  creases?: string;
  /**
   * Sharpness of the edges that `creases` adds: 0 to 10, of which 10 is `infinite`.
   * @default infinite
   */
  crease_sharpness?: number | "infinite";
  /**
   * Weights on triangles: `smooth` is OpenSubdiv's TRI_SUB_SMOOTH. Wins over a tag of the file.
   * @default catmull-clark
   */
  triangles?: "catmull-clark" | "smooth";
  /**
   * Which points of the file are one. `auto` joins the ends of two border edges that run along the same two
   * positions in opposite directions, where no third edge runs there: seams that an exporter cut close again, and
   * sheets that merely touch stay apart. An OBJ with subdivision tags (`t`) stays as it is, and so does tweend
   * JSON. `exact` also makes one of all points at the same place, a distance of all within it of a first one, in
   * the model's unit. `none` takes the vertices as the file has them. Faces that are left with fewer than three
   * points go. The description tells the `welded_points` of `auto`.
   * @default auto
   */
  weld?: ("auto" | "exact" | "none") | number;
  /**
   * How glTF triangles become polygons: `ngon` trusts FB_ngon_encoding alone, `auto` also pairs triangles that a
   * plain exporter split: those that follow one another, in the pattern that most have, then those that look like a
   * split rectangle; never across a material, a UV seam or a hard edge, and in no mesh that has few such pairs. The
   * description counts the `paired_quads`.
   * @default ngon
   */
  quads?: "ngon" | "auto" | "off";
  /**
   * Points pushed to the limit surface.
   * @default false
   */
  limit?: boolean;
  /**
   * `auto`: at level 0 the normals and tangents that the file itself has, made unit, split where the file splits
   * them (not with `limit=true`, nor of meshes that `skin=bake` moves); where it has none, and at other levels,
   * those of `limit`. `limit`: normals from exact limit tangents. `none`: none. Those of `limit` are those of the
   * limit surface at every level and with every `limit`, of unit length, and split along edges that stay sharp for
   * ever. A point without one tangent plane (faces that are no single fan, two faces back to back, a bilinear
   * surface) has at each face the normal of the face's two edges there. Where two tangents are parallel or nothing,
   * the normal is that of the face of the refined cage round the point, and 0 1 0 where that has none either; so no
   * normal is zero or not a number.
   * @default auto
   */
  normals?: "auto" | "limit" | "none";
  /** Which clips the answer keeps as glTF animations: by default all of the model, with their indices; else those
   * named, with commas between them, at most 256, in that order; `{model id}/{name}` borrows one of another stored
   * model by the names of nodes; `none` leaves them out. A value that is a clip's whole name, commas or `none`
   * included, means that clip. With times the clips, by default the first, move the model together (where two move
   * the same path of one node, the later one of the list does): one time poses it, several bake one animation with
   * keys at exactly those, which together may have no more bytes than an upload. */
  clip?: string;
  /** Times in seconds, separated by commas. */
  at?: string | number | number[];
  /**
   * First of evenly spaced times; needs `fps`.
   * @default 0
   */
  from?: number;
  /** Last of evenly spaced times, default the clip's end; needs `fps`. */
  to?: number;
  /** Evenly spaced times: so many a second. Excludes `at`. */
  fps?: number;
  /**
   * Of clips kept as animations: the most degrees that a rotation may be off, at any time. Given this or
   * `tolerance_m`, every track that is neither STEP nor CUBICSPLINE gets as few LINEAR keys as that allows; else
   * tracks that glTF can hold keep their keys, and only the others (`euler`, `nlerp`, `squad`, axis-angle) are made
   * of LINEAR keys, under this tolerance. X-Tweend-Error tells what is left.
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
   * What becomes of skins and morph targets: kept with the surface, or, with one time, the control meshes are moved
   * by them first, and the surface is that of the moved mesh. A baked skinned mesh hangs on a root node of its own,
   * for its points are where the world has them.
   * @default keep
   */
  skin?: "keep" | "bake";
  /**
   * `none`: the node tree and the animation alone.
   * @default all
   */
  meshes?: "all" | "none";
  /**
   * How glTF holds what it draws. `quantized` (KHR_mesh_quantization): positions in 16 bits, which the matrices of
   * a skin undo, or a child node that is added for the mesh; normals and tangents in 8 bits; texture coordinates
   * and colours in 16 where they are from 0 to 1; weights in 8; each primitive has its own vertices, at most 65,534
   * of them, and 16-bit indices. Meshes that EXT_mesh_gpu_instancing shows, that have points or lines, or whose
   * weights KHR_animation_pointer moves keep positions as floats. `meshopt`: the same by EXT_meshopt_compression;
   * triangles may come in another order, unless `polygons=ngon`. Its size is known once a GLB of the same options
   * has been made: until then `HEAD` bears no `Content-Length`, and `surface.json` says `null`. OBJ is the same in
   * every encoding.
   * @default float
   */
  encoding?: "float" | "quantized" | "meshopt";
  /**
   * `ngon`: triangles in the fan order of FB_ngon_encoding, declared.
   * @default triangles
   */
  polygons?: "triangles" | "ngon";
  /**
   * `false` leaves out what is modelled onto the levels of the meshes. It is of the scheme that it was modelled by,
   * and not for `boundary=open`: 422 where the two do not go together.
   * @default true
   */
  details?: boolean;
  /**
   * `1`: `Content-Disposition` is `attachment`, so that browsers save the answer, by the model's name.
   * @default 0
   */
  download?: "0" | "1";
}
export interface PoseOptions {
  /** A clip's name, default the first; `{model id}/{name}` borrows one of another stored model by the names of
   * nodes. Several with commas between them, at most 256, move together: where two move the same path of one node,
   * the later one of the list does. `none` is the rest pose. A value that is a clip's whole name, commas or `none`
   * included, means that clip. */
  clip?: string;
  /** Times in seconds, separated by commas, in any order. Without `at` and `fps`: 0. */
  at?: string | number | number[];
  /**
   * First of evenly spaced times; needs `fps`.
   * @default 0
   */
  from?: number;
  /** Last of evenly spaced times, default the clip's end; needs `fps`. */
  to?: number;
  /** Evenly spaced times: so many a second. Excludes `at`. */
  fps?: number;
  /**
   * Relative to the parent, or in the model's space. In world space shear shows in matrices alone.
   * @default local
   */
  space?: "local" | "world";
  /**
   * Form of a pose. Matrices are column-major.
   * @default trs
   */
  as?: "trs" | "matrix" | "euler" | "axis-angle";
  /**
   * With as=euler. XYZ means R = Rx Ry Rz; triples are always the angles about x, y, z. Over a sequence of times
   * each sample is the representation nearest to the one before.
   * @default XYZ
   */
  order?: "XYZ" | "XZY" | "YXZ" | "YZX" | "ZXY" | "ZYX";
  /**
   * With as=euler and as=axis-angle.
   * @default radians
   */
  unit?: "radians" | "degrees";
  /** Names of nodes, separated by commas, default all. The answer keeps the file's order. A name that several nodes
   * bear means all of them. */
  nodes?: string | string[];
  /**
   * For every rotation track, default as stored. `linear` and `slerp` are the same. Keys become quaternions first,
   * but `euler` leaves Euler keys as they are and makes XYZ triples of others; `cubicspline` needs tangents in
   * every rotation track.
   */
  interpolation?: "step" | "linear" | "cubicspline" | "slerp" | "nlerp" | "squad" | "euler";
  /**
   * What becomes of times outside the clip.
   * @default clamp
   */
  loop?: "clamp" | "repeat" | "pingpong";
  /**
   * With as=matrix: joint matrices, world x inverse bind, column-major, of all skins one after the other. The
   * answer's `nodes` then names their joints in that order, and `skins` tells where each begins. All joints are
   * given: the parameter `nodes` beside it is an error.
   * @default false
   */
  skinning?: boolean;
}
export interface LiveOptions {
  /** A clip's name, default the first; `{model id}/{name}` borrows one of another stored model by the names of
   * nodes. Several with commas between them, at most 256, move together: where two move the same path of one node,
   * the later one of the list does. `none` is the rest pose. A value that is a clip's whole name, commas or `none`
   * included, means that clip. */
  clip?: string;
  /**
   * Seconds of the clip that pass in a second; negative: backwards, from the clip's end unless `from` says
   * otherwise.
   * @default 1
   */
  speed?: number;
  /**
   * Frames a second.
   * @default 30
   */
  fps?: number;
  /**
   * Where on the clip frame 0 is, in seconds.
   * @default 0
   */
  from?: number;
  /** When frame 0 is due, as Unix time in milliseconds: whoever asks with the same start, wherever and whenever,
   * sees the same at the same time. Frame n is due n x 1000 / `fps` later. Default: when the stream begins. */
  start?: number;
  /**
   * What becomes of times outside the clip.
   * @default clamp
   */
  loop?: "clamp" | "repeat" | "pingpong";
  /**
   * Relative to the parent, or in the model's space. In world space shear shows in matrices alone.
   * @default local
   */
  space?: "local" | "world";
  /**
   * Form of a pose. Matrices are column-major.
   * @default trs
   */
  as?: "trs" | "matrix" | "euler" | "axis-angle";
  /**
   * With as=euler. XYZ means R = Rx Ry Rz; triples are always the angles about x, y, z. Over a sequence of times
   * each sample is the representation nearest to the one before.
   * @default XYZ
   */
  order?: "XYZ" | "XZY" | "YXZ" | "YZX" | "ZXY" | "ZYX";
  /**
   * With as=euler and as=axis-angle.
   * @default radians
   */
  unit?: "radians" | "degrees";
  /** Names of nodes, separated by commas, default all. The answer keeps the file's order. A name that several nodes
   * bear means all of them. */
  nodes?: string | string[];
  /**
   * For every rotation track, default as stored. `linear` and `slerp` are the same. Keys become quaternions first,
   * but `euler` leaves Euler keys as they are and makes XYZ triples of others; `cubicspline` needs tangents in
   * every rotation track.
   */
  interpolation?: "step" | "linear" | "cubicspline" | "slerp" | "nlerp" | "squad" | "euler";
  /**
   * With as=matrix: joint matrices, world x inverse bind, column-major, of all skins one after the other. The
   * answer's `nodes` then names their joints in that order, and `skins` tells where each begins. All joints are
   * given: the parameter `nodes` beside it is an error.
   * @default false
   */
  skinning?: boolean;
}
export interface TracksOptions {
  /** The name of one of the model's own clips, default the first. */
  clip?: string;
}
