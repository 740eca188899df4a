/* The parameters of a surface: the one table by which they are read, and printed for every key. */
#ifndef API_SURFACE_QUERY_H
#define API_SURFACE_QUERY_H

#include "clips.h"
#include "flat_answer.h"
#include "reduced_clips.h"
#include "rules.h"
#include "times.h"
#include "tweend/format.h"
#include "upload.h"

struct api_surface_request;

/* A parameter that a form of the answer has no use for. */
typedef struct api_idle {
  const char *name;
  const char *own;           /* the value that says what the form does anyway; NULL: none */
  const char *unless, *says; /* a parameter with which it is of use, and a word that its value has; or NULL */
  bool is_of_clips;          /* of use where the answer is of a time */
} api_idle;

/* A form of the answer. */
typedef struct api_surface_form {
  bool is_gltf;      /* holds clips, skins and encodings; surface.json tells of one that does */
  const char *still; /* the name of a form that shows the whole model at one time; else NULL */
  const char *unit;  /* the unit of its lengths unless another one is asked for; NULL: always the model's */
  tw_format format;  /* of glTF; JSON tells of a GLB */
  tw_flat_form flat; /* of STL, PLY and points */
  uint32_t lacks;    /* enum api_lack */
  const api_idle *idle; /* ends with a row without a name; NULL: none */
  bool is_counts;       /* surface.json */
  bool is_points;       /* surface.bin */
  bool has_tags;        /* a still form whose level 0 reads back as the cage */
  bool is_chunked;      /* its size is known only at its end */
  /* Warns of what is lost, and opens the stream where that is little work; may be NULL. */
  api_outcome (*open)(api_call *call, struct api_surface_request *request);
  /* The size, or a bound of it where that is known only at the end. */
  tw_status (*predict)(api_call *call, const struct api_surface_request *request, uint64_t *size);
  /* Answers; not HEAD, unless with counts. */
  api_outcome (*reply)(api_call *call, struct api_surface_request *request);
} api_surface_form;

/* Values of normals, skin and meshes. */
enum { API_NORMALS_AUTO, API_NORMALS_LIMIT, API_NORMALS_NONE };
enum { API_SKIN_KEEP, API_SKIN_BAKE };
enum { API_MESHES_ALL, API_MESHES_NONE };

/* Bits of `with`. */
enum { API_WITH_NORMALS = 1, API_WITH_UVS = 2 };

/* level=auto. */
typedef struct api_auto_level {
  bool is_on;
  bool is_share;  /* `error` is a share of the model's size */
  double error;   /* the most that the triangles may be from the limit surface; 0: not given */
  uint64_t faces; /* the most of the answer; 0: not given */
  /* What was chosen (auto_level.c): */
  uint32_t level_count;
  const uint32_t
      *levels;          /* [level_count] of each mesh of the plan; NULL: none yet, or all have query->level */
  const double *errors; /* [meshes of the scene] in the model's unit, at most; INFINITY: not known */
  double reached;       /* the greatest of them */
} api_auto_level;

/* A surface's parameters, and what they make of each other. Where a number is -1, the parameter is not given,
 * so the file's own tags apply. */
typedef struct api_surface_query {
  /* The surfaces. */
  uint64_t level; /* as given, or the highest that was chosen; api_plan_check checks it */
  api_auto_level auto_level;
  int scheme, boundary, uv, creasing, triangles;
  api_reading reading; /* how the model is read */
  bool limit;
  int normals;
  bool details;   /* apply the details of the mesh's levels */
  int influences; /* the most influences of a point, 0: all of the file's */
  tw_creases creases;
  double crease_degrees;  /* of TW_CREASES_ANGLE, else 0 */
  float crease_sharpness; /* of the edges that `creases` adds, else 0 */
  /* How they are written. */
  int polygons; /* a tw_polygons */
  int encoding; /* a tw_encoding */
  api_flat_query flat;
  bool with_shells; /* surface.json tells of shells */
  bool has_points;  /* nothing poses the meshes: there is an answer of the points of one */
  const char *mesh; /* whose points surface.bin has; NULL: of the only one */
  int with;         /* what it has besides: API_WITH_* */
  /* What of the model is shown. */
  int skin, meshes;
  const char *clip;     /* as in api_clips_choose; NULL: all clips, or the first with times */
  api_clip_terms terms; /* as in api_clips_choose */
  api_times times;
  api_reduction reduction;
  /* Made of the above. */
  bool own_normals;         /* keep the file's normals, at level 0 */
  bool tagged;              /* keep the tags of the cage, at level 0 */
  bool with_holes;          /* holes become faces (tw_mesh_open_holes), details are left out */
  api_clip_choices choices; /* the clips, see api_scene_take_clips */
  const char *idle;         /* what was asked for and is of no use to the form, as a list; NULL: nothing */
} api_surface_query;

/* For the table of routes. Those of levels.json are all but those of the level and of other forms. */
extern const api_rule api_surface_rules[], api_levels_rules[];

/* The forms of a surface's answer: places of the route's offers, and of the table of surface_forms.c. */
enum {
  API_SURFACE_GLB,
  API_SURFACE_GLTF,
  API_SURFACE_OBJ,
  API_SURFACE_COUNTS, /* surface.json */
  API_SURFACE_STL,
  API_SURFACE_PLY,
  API_SURFACE_3MF,
  API_SURFACE_POINTS, /* surface.bin */
  API_SURFACE_FORMS
};

/* Fills in the defaults and reads what the call's query has. 400. */
api_outcome api_surface_query_read(api_call *call, api_surface_query *out);

/* Fills in what the form of the answer makes of parameters that were read, but for the clips, and checks them
 * together. 400. */
api_outcome api_surface_query_complete(api_call *call, const api_surface_form *form,
                                       api_surface_query *query);

/* Fills in what level 0 keeps; again once a level is chosen. */
void api_surface_query_keep_cage(const api_surface_form *form, api_surface_query *query);

/* Fails with 400 for level=auto, which goes with answers alone. */
api_outcome api_surface_query_fix_level(api_call *call, const api_surface_query *query);

/* Whether the request shows the model at one time. */
static inline bool api_is_moment(const api_surface_query *query) {
  return query->times.list && query->times.count == 1;
}

/* Whether there is an answer of meshes alone, as they are at one time or at rest: OBJ, STL, PLY, 3MF. */
bool api_surface_has_still(const api_surface_query *query);

/* Whether the request bakes the model as it rests, of no clip. */
static inline bool api_is_baked_at_rest(const api_surface_query *query) {
  return query->skin == API_SKIN_BAKE && !query->times.is_given;
}

/* What is made of a request, and found by the parameters that it depends on. */
typedef enum api_surface_key {
  API_KEY_PLAN = 1,
  API_KEY_PACKS = 2,
  API_KEY_REDUCED = 4, /* reduced keyframes */
  API_KEY_ANSWER = 8,  /* without the model and the form: for entity tags */
  API_KEY_ERRORS = 16  /* of levels */
} api_surface_key;

/* Prints the parameters with their defaults, in one order: equal texts mean equal bytes. head: what stands
 * before them, after the model's id; NULL: neither does. NULL without memory. */
const char *api_surface_key_print(api_call *call, const api_surface_query *query, api_surface_key key,
                                  const char *head);

#endif
