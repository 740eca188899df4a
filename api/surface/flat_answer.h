/* Answers for printers and scanners, STL, PLY and 3MF: their unit, and what they have no place for. */
#ifndef API_FLAT_ANSWER_H
#define API_FLAT_ANSWER_H

#include "call.h"
#include "tweend/format.h"

/* The unit of an answer's coordinates. The model's is the metre. */
typedef struct api_length_unit {
  const char *name, *word, *of_3mf; /* "mm", "millimetres", "millimeter" */
  double scale;                     /* how many a metre has */
} api_length_unit;

typedef struct api_flat_query {
  const api_length_unit *unit; /* NULL: the lengths are the model's */
  bool is_unit_given;
  double scale; /* of the model, besides the unit */
} api_flat_query;

/* Reads `unit` and `scale`. fallback: the name of the default unit; NULL: the answer's form has its own unit,
 * so both are refused. Fails with 400. */
api_outcome api_flat_read(api_call *call, const char *fallback, api_flat_query *out);

/* Prints the parameters with defaults, for entity tags. */
void api_flat_print(const api_flat_query *query, tw_text *text);

/* What coordinates of the model are multiplied by. */
double api_flat_scale(const api_flat_query *query);

/* Warns of a unit that nobody asked for. */
api_outcome api_flat_warn_of_unit(api_call *call, const api_flat_query *query);

/* What forms of answers have no place for. */
enum api_lack {
  API_LACKS_NODES = 1,
  API_LACKS_MATERIALS = 2,
  API_LACKS_TEXTURES = 4, /* and all of materials but their base colours */
  API_LACKS_UVS = 8,
  API_LACKS_MORE_UVS = 16, /* behind the first set */
  API_LACKS_COLORS = 32,
  API_LACKS_CORNER_COLORS = 64,
  API_LACKS_CORNER_NORMALS = 128,
  API_LACKS_CORNER_UVS = 256,
  API_LACKS_SCENE = 512,      /* instances, attributes, points and lines */
  API_LACKS_TRANSFORMS = 1024 /* of the texture coordinates that the form has */
};

/* Warns of what a scene has and the call's form has not. lacks: of enum api_lack. is_hard: edges that the
 * file does not tag are sharp. */
api_outcome api_flat_warn_of_losses(api_call *call, const tw_scene *scene, uint32_t lacks, bool is_hard);

/* Warns that all was moved by minus the origin. */
api_outcome api_flat_warn_of_move(api_call *call, const double origin[3]);
api_outcome api_flat_warn_of_far(api_call *call, uint32_t count); /* of tw_flat_stream_far_count */

#endif
