/* How far levels are from the limit surface: what the files of surface_error.c share. */
#ifndef TWEEND_SURFACE_ERROR_H
#define TWEEND_SURFACE_ERROR_H

#include "limit.h"
#include "refine.h"
#include "surface.h"
#include "vector3.h"

enum {
  TW_AROUND_MAX = 64,         /* faces at a vertex that are looked at one by one */
  TW_ERROR_DEPTH = 3,         /* how many levels deeper a face is compared with what comes of it */
  TW_ERROR_FURTHER_LEVELS = 6 /* below the last one asked for, so that what is left is small beside it */
};

/* Points may slide along the surface where each face around a face has a normal whose cosine with the face's
 * own is at least this; elsewhere their whole differences count. */
#define TW_LEAST_COSINE 0.3

typedef enum tw_error_state {
  TW_FACE_HIDDEN,   /* left out of the answer */
  TW_FACE_AROUND,   /* measured, or outside: only there for the faces beside it */
  TW_FACE_GIVEN_UP, /* there for these too: what was left of it was little */
  TW_FACE_OPEN,     /* from here on open; a regular face that varies too much may be left to its children, */
  TW_FACE_LAST = TW_FACE_OPEN + 2 /* and to theirs, but no further */
} tw_error_state;

/* A level, or the part of it around open faces. */
typedef struct tw_error_part {
  tw_arena *arena;
  tw_topology topology;
  double *control;     /* [vertices][3] */
  const double *shown; /* as answers have them */
  uint8_t *states;     /* [faces] of tw_error_state */
  uint8_t *is_rim;     /* [vertices] */
  double *normals;     /* [corners][3] tw_error_find_normals; NULL: not found yet */
  uint32_t *made;      /* [faces] the face of the level as it was made; NULL: the same, as nothing is cut */
  double *errors;      /* [faces of the level as it was made] the distance of each from the limit */
  double *wholes;      /* [the same] as tw_face_measure has them */
  double *nexts;       /* [the same] of measured faces: the same of their children */
  double *afters;      /* [the same] and of these children's children */
  float *falls;        /* [the same] how much of these the next level has at most, and each after it */
  uint32_t level, open_count;
  uint32_t batch_level; /* at which it began as a batch of faces, whose children are too many to be made at
                           once; 0: it is no batch */
} tw_error_part;

/* What error_rings.c knows of a valence. */
typedef struct tw_error_wheel tw_error_wheel;

/* What all levels share. */
typedef struct tw_measuring {
  const tw_mesh *mesh;
  const tw_surface_options *options;
  const tw_parallel_for *parallel;
  tw_rules rules;
  tw_detail_list details;
  double size;                   /* the greatest coordinate */
  uint32_t level_max, faces_max; /* of the wish */
  tw_arena *arena;
  const tw_error_wheel **wheels; /* tw_error_find_wheels */
} tw_measuring;

/* How a face's points may slide. corners, edges: the least cosine between the face's normal and those of the
 * faces at each corner and across each edge, below 0 where the surface ends; own: of the triangles at its own
 * corners; all rounded down. reach: the longest slide (tw_error_reach); 0 where nothing may slide. */
typedef struct tw_error_frame {
  float corners[4], edges[4], own, reach;
} tw_error_frame;

/* A level as it was made, and what is left of it when the next one is. */
typedef struct tw_level_errors {
  uint32_t face_count, vertex_count;
  uint32_t *corners; /* of all faces, in the order of their corners */
  uint32_t *begins;  /* [face_count + 1] the first corner of each face */
  double *points;    /* [vertex_count][3] as answers have them */
  double *control;   /* [vertex_count][3] control points: the same ones, unless answers have limit points */
  double *errors; /* [face_count] the distance of a face from the limit; of open ones it is summed up last */
  double *wholes; /* [face_count] as tw_face_measure has them; INFINITY: not measured */
  bool *is_plain; /* [face_count] as tw_face_measure has them */
  double *ring_rests;  /* [face_count] of faces that a ring told of: what it is TW_ERROR_DEPTH levels deeper;
                          below 0: of others */
  uint32_t left_count; /* faces that are left; 0 at the last level */
  uint32_t *made;      /* [left_count] as in tw_error_part; ascending */
  uint32_t *children;  /* [left_count + 1] the first child of each */
  double *steps;       /* [left_count] of open faces from their children; below 0: of others */
  tw_error_frame *frames; /* [left_count] of open faces of three or four corners */
  double *around;         /* [vertex_count] the greatest error of a vertex's faces; of levels summed up */
  uint32_t
      *fan_begins; /* [vertex_count + 1] the first of each vertex's faces in fan_faces; NULL: not found */
  uint32_t *fan_faces;
} tw_level_errors;

typedef struct tw_offset {
  double normal, slide, whole; /* along the face's normal, across it, and its length */
} tw_offset;

enum { TW_ERROR_LOOKED = 3 }; /* levels of a face that are told apart */

/* What is known of a face whose deeper levels follow from it. */
typedef struct tw_face_measure {
  double errors[TW_ERROR_LOOKED]; /* its distance from the limit on its own level and the next ones; a quarter
                                     of the last one from there on. Below 0: of a face that is open still */
  double whole; /* the first if nothing slides, from points of the face to those of its own limit */
  double usual; /* about what it would be if nothing varied: where it is much more, its children tell more */
  tw_offset offset; /* of a patch: between its points and those of the face at the same parameters */
  bool is_plain;    /* it is a patch of smooth rules, and nothing around it is a rim */
} tw_face_measure;

/* Of numbers: unlike fmax and fmin they are no calls. */
static inline double tw_greater(double a, double b) {
  return a > b ? a : b;
}
static inline double tw_lesser(double a, double b) {
  return a < b ? a : b;
}

/* A cosine as a frame has it. */
static inline float tw_error_rounded_down(double cosine) {
  return (float)cosine - 1e-6F;
}

static inline const double *tw_point_at(const double *points, uint32_t vertex) {
  return points + 3 * (size_t)vertex;
}

/* The face of a level as it was made that a face of a part of it is. */
static inline uint32_t tw_error_as_made(const tw_error_part *p, uint32_t face) {
  return p->made ? p->made[face] : face;
}

/* Splits a vector. normal: 0 0 0 where there is none. */
static inline tw_offset tw_offset_split(const double vector[3], const double normal[3]) {
  double along = tw_dot3(vector, normal), across[3];
  for (int c = 0; c < 3; c++) across[c] = vector[c] - along * normal[c];
  return (tw_offset){fabs(along), tw_length3(across), tw_length3(vector)};
}

/* ---- levels and parts of them: error_parts.c ---------------------------------------------------- */

/* Makes level 0, or the next level of a part; the caller destroys the part's arena, also of one that failed.
 * Of a cage of polygons at the limit the part's `shown` is NULL: the points are those of the next level. */
tw_status tw_error_begin(tw_measuring *m, tw_error_part *p);
tw_status tw_error_refine(const tw_measuring *m, const tw_error_part *p, tw_error_part *child);

/* A copy of a level's points in the part's arena; NULL without memory. */
double *tw_error_copy_points(const tw_error_part *p, const double *points);

/* Lists the corners of open faces and of some rows around them; NULL without memory. */
uint32_t *tw_error_list_corners(const tw_error_part *p, int rows, uint32_t *count);

/* Whether faces may be measured without all others: under Chaikin's rule all edges at a vertex decide how
 * sharp they stay. */
bool tw_error_can_cut(const tw_measuring *m, const tw_error_part *p);

/* Makes a part of some faces, by their corners. Points at its edge will be wrong after a step, but no step
 * reads them. */
tw_status tw_error_cut_out(const tw_measuring *m, const tw_error_part *p, const uint32_t *corners,
                           uint32_t count, tw_error_part *out);

/* Cuts away what is not around open faces, where that is much. */
tw_status tw_error_cut(const tw_measuring *m, tw_error_part *p);

/* ---- faces and what is around them: error_faces.c --------------------------------------------- */

/* The unit normal of a polygon: area vectors summed (Newell). 0 0 0 where they cancel. */
void tw_corners_normal(const double *points, const uint32_t *corners, uint32_t size, double normal[3]);
void tw_error_normal(const tw_error_part *p, uint32_t face, double normal[3]);

/* Finds the unit normal of the triangle that each corner and its two neighbours span; NAN where that has no
 * area, so that no comparison counts it. The functions below read these. */
tw_status tw_error_find_normals(const tw_parallel_for *parallel, tw_error_part *p);

/* The least cosine between a normal and those of a face's corners. */
double tw_error_face_cosine(const tw_error_part *p, uint32_t face, const double normal[3]);

/* The same of all faces at a corner's vertex, also beyond sharp edges. Below 0 where these are no ring of
 * shown faces, so that the surface ends there. */
double tw_error_ring_cosine(const tw_error_part *p, uint32_t corner, const double normal[3]);

/* The slope of a face whose normal has this cosine with the direction of view; and the greatest slope of the
 * faces around a face, seen along its normal. Infinite below TW_LEAST_COSINE. */
double tw_error_slope(double cosine);
double tw_error_slope_around(const tw_error_part *p, uint32_t face, const double normal[3]);

/* Whether a point lies over a convex quad, seen along the quad's normal. */
bool tw_error_is_over(double quad[4][3], const double *point, const double normal[3]);

/* The greatest slope of a quad's own triangles. */
double tw_error_quad_slope(double corners[4][3], const double normal[3]);

/* The greatest slope of the faces around a face, also beyond sharp edges. */
double tw_error_slope_beyond(const tw_error_part *p, uint32_t face, const double normal[3]);

/* Whether a vertex is inside, and nothing at it is sharp. */
bool tw_error_is_plain(const tw_topology *t, uint32_t vertex);

/* The corner at the same vertex, in the face across the edge to the previous corner, or across that to the
 * next; UINT32_MAX at a rim of the limit surface. */
uint32_t tw_error_turn_left(const tw_topology *t, uint32_t corner);
uint32_t tw_error_turn_right(const tw_topology *t, uint32_t corner);

/* Lists the corners of a vertex on one side of sharp edges, `corner` first. Returns how many; 0 where there
 * are over TW_AROUND_MAX. */
uint32_t tw_error_list_around(const tw_topology *t, uint32_t corner, uint32_t out[TW_AROUND_MAX]);

/* Half of the mean length of a face's edges: as far as its points may slide. */
double tw_error_reach(const tw_error_part *p, uint32_t face);

/* Whether the surface ends at an edge; whether it ends or is sharp there; and marks the vertices of such
 * rims. */
bool tw_error_is_end(const tw_error_part *p, uint32_t edge);
bool tw_error_is_rim(const tw_error_part *p, uint32_t edge);
tw_status tw_error_find_rims(tw_error_part *p);

/* ---- regular faces: error_patch.c --------------------------------------------------------------- */

/* The control points of a patch: [v][u], the face's own corners in the middle. */
typedef struct tw_error_net {
  double points[4][4][3];
} tw_error_net;

tw_face_measure tw_error_of_patch(const tw_measuring *m, const tw_error_part *p, uint32_t face);

/* Lowers the distances of a regular face of smooth rules, where the first is more than is enough: a closer
 * look, which costs more. The level shows control points, not limit points. */
void tw_error_look_closely(const tw_error_part *p, uint32_t face, double enough, tw_face_measure *own);

/* The same at limit points all over a face, where its children have no room; also where the level shows limit
 * points. enough: on its own level and the next ones. */
void tw_error_look_all_over(const tw_error_part *p, uint32_t face, const double enough[TW_ERROR_LOOKED],
                            tw_face_measure *own);

/* Both for a patch around which nothing is a rim. limit: its level shows limit points. */
void tw_error_look_at_net(const tw_error_net *n, bool limit, const double enough[TW_ERROR_LOOKED],
                          double errors[TW_ERROR_LOOKED]);

/* The distance of a patch, which its children have a quarter of. *hull: what it and they have at most where
 * all these are graphs, seen along the third axis. */
double tw_error_of_net(const tw_error_net *n, bool limit, double *hull);

/* ---- faces around one irregular point: error_rings.c -------------------------------------------- */

/* Makes room in m->wheels, and puts there what is needed for the valences of a level's vertices. */
tw_status tw_error_make_wheels(tw_measuring *m);
tw_status tw_error_find_wheels(const tw_measuring *m, const tw_topology *t);

/* The valence of a vertex that may have a ring; 0: none has. */
uint32_t tw_error_wheel_valence(const tw_topology *t, uint32_t vertex);

/* The distances of the faces around an irregular vertex from the limit: at out[0] on their own level, then on
 * the deeper ones. Returns how many of these were found; deeper levels are no farther than the last one.
 * enough: what is less is looked at no further. known: [TW_ERROR_RING_LEVELS + 1] distances from the same
 * level on: what is more is looked at closely, `out` having what was found without; NULL: nothing is. 0: the
 * vertex is regular, or not alone, or nothing is wanted any more; faces have no second irregular one
 * otherwise. out: [TW_ERROR_RING_LEVELS]
 */
enum { TW_ERROR_RING_LEVELS = TW_LEVEL_MAX + TW_ERROR_FURTHER_LEVELS + 1 };
uint32_t tw_error_of_ring(const tw_measuring *m, const tw_error_part *p, uint32_t vertex, double enough,
                          const double *known, double *out);

/* ---- other faces: error_steps.c ----------------------------------------------------------------- */

/* The difference between a face and what comes of it. */
typedef struct tw_error_gap {
  double normal[3]; /* the face's */
  double reach;     /* the longest way that a point may slide */
  double size;      /* the greatest difference so far */
  double sums[4];   /* over a hull: the greatest with what a map adds, as the weight of each corner bounds it:
                       of 1 and 3 the map onto the triangles at diagonal 0 2, of 0 and 2 the other */
} tw_error_gap;

/* Takes a point and its partner into account, by the whole difference or by its part along the normal and the
 * slide, whichever is less: points between those of either kind move by a mean of both. cosine: between the
 * normal and those of the faces that the point may slide to; below 0: it may not. */
void tw_error_gap_take(tw_error_gap *g, const double *to, const double *from, double cosine);

/* The point of an edge that is nearest to another one. Points of edges and diagonals have partners there: so
 * they may slide along these, as they do around irregular points, at no cost. Returns its share of b. */
double tw_error_nearest_on(const double *a, const double *b, const double *to, double out[3]);

/* The distance between a quad and its children. next: points of these around the quad, from its first corner
 * on, and the middle. slope: the greatest around, seen along the normal. */
double tw_error_of_quad(double own[4][3], double next[9][3], const double normal[3], double slope);

/* The planes of the triangles at each corner of a face, where points may slide over these, by normals whose
 * part along the face's own normal is 1. A count of 0: they are not known. */
typedef struct tw_error_planes {
  uint32_t counts[4];
  double normals[4][TW_AROUND_MAX][3];
} tw_error_planes;

/* The hull of a quad's corners (error_gap.c): where its diagonals are near each other. */
typedef struct tw_error_hull {
  double shares[2]; /* of the way from corner 0 to 2, and from 1 to 3; neither 0 nor 1 */
  double width;     /* from one of these points to the other */
} tw_error_hull;

/* A face of three or four corners, and points of a finer surface over it. */
typedef struct tw_error_base {
  uint32_t size;
  const double *corners[4];
  double normal[3], around; /* the least cosine at its corners */
  const tw_error_frame *frame;
  const tw_error_planes *planes; /* NULL: not looked for */
  const tw_error_hull *hull;     /* partners of points inside are anywhere in it; NULL: on triangles */
} tw_error_base;

static inline tw_error_gap tw_error_gap_over(const tw_error_base *b) {
  return (tw_error_gap){.normal = {b->normal[0], b->normal[1], b->normal[2]},
                        .reach = (double)b->frame->reach};
}

/* Where a point of the finer surface lies over a face: bits. */
enum {
  TW_ERROR_ON_EDGE = 1,         /* one for each of four edges, from a corner to the next */
  TW_ERROR_IN_TRIANGLE = 1 << 4 /* one for each triangle of the face: of a quad 0 1 2, 0 2 3, 1 2 3, 0 1 3 */
};

/* The hull of a quad (error_gap.c). */
tw_error_hull tw_error_find_hull(const double *const corners[4]);

/* Finds a face's least cosine, and the places of its own corners (error_gap.c). */
void tw_error_begin_base(tw_error_base *b, uint8_t places[4]);

/* Takes a point of the finer surface into account (error_gap.c). */
void tw_error_take_point(const tw_error_base *b, tw_error_gap *g, uint8_t place, const double *point);

/* The greatest difference. Over a hull: of each map the least of its bounds; of both maps the greater, as the
 * quad may be cut either way. */
static inline double tw_error_gap_size(const tw_error_base *b, const tw_error_gap *g) {
  if (!b->hull) return g->size;
  double either = tw_greater(tw_lesser(g->sums[0], g->sums[2]), tw_lesser(g->sums[1], g->sums[3]));
  return tw_lesser(either, g->size + b->hull->width);
}

/* The distance of a patch of the limit surface from the face that it lies over, by limit points all over it
 * (error_patch.c). places: of the patch's corners. */
double tw_error_of_limits(const tw_error_base *b, const tw_error_net *n, const uint8_t places[4]);

/* Where the quarters of a quad lie over a face, from the places of its corners: each from the corner that
 * lies as the quad's first does. */
void tw_error_split_places(const uint8_t at[4], uint8_t out[4][4]);

/* The control points of two rows of faces around an irregular vertex are in this order, as a wheel numbers
 * them: the vertex; for each face at the vertex its next corner and its opposite one; for each of these faces
 * the four points of the second row beyond its opposite corner. */
enum { TW_ERROR_ROW = 2, TW_ERROR_ROWS = 6, TW_ERROR_VALENCE_MAX = 32 };

/* The distance of the limit over a face at an irregular vertex from another face that it lies over, by limit
 * points. points: [1 + TW_ERROR_ROWS x valence] from that face on; places: of its corners, from the irregular
 * one on; rest: its distance TW_ERROR_DEPTH levels deeper. INFINITY without a wheel. */
double tw_error_of_sector(const tw_measuring *m, const tw_error_base *b, double (*points)[3],
                          uint32_t valence, const uint8_t places[4], double rest);

/* How points may slide over a face; of polygons of five or more corners `own` and `reach` alone. */
void tw_error_find_frame(const tw_error_part *p, uint32_t face, const double normal[3], tw_error_frame *out);

/* The distance between a face and its children. next: the points shown on the next level. frame: the face's.
 */
double tw_error_of_step(const tw_measuring *m, const tw_error_part *p, const double *next, uint32_t face,
                        tw_error_frame *frame);

/* The greatest distance from each vertex to a point of its faces, in the part's arena. NULL without memory.
 */
double *tw_error_find_radii(const tw_error_part *p);

/* The distance of a face, and of all that is made of it, from the limit surface. shares: room for
 * tw_refine_mask_capacity. */
double tw_error_of_rest(const tw_measuring *m, const tw_error_part *p, const double *radii, uint32_t face,
                        tw_share *shares);

/* ---- sums over levels: error_sums.c ------------------------------------------------------------- */

/* The distance of each open face of levels[0] from the limit, from those of the levels after it, which are
 * summed up. depth: how many these are. *most: raised to the greatest. scratch: for what is kept. */
tw_status tw_error_sum_up(const tw_measuring *m, tw_arena *scratch, tw_level_errors *levels, uint32_t depth,
                          double *most);

#endif
