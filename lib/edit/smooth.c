/* Smooth: moves points towards the mean of their neighbours. Taubin, "A signal processing approach to fair
 * surface design" (1995): each step that shrinks the mesh is followed by a slightly larger one that inflates
 * it. Together they remove short waves and keep long ones, and so the volume. */
#include <string.h>

#include "editor.h"

/* Taubin's own pair of factors. Waves below the frequency 1 / TAUBIN_SHRINK + 1 / TAUBIN_GROW = 0.1 pass;
 * frequencies range from 0 to 2. */
#define TAUBIN_SHRINK 0.6307
#define TAUBIN_GROW   (-0.6732)
#define LAPLACE       0.5

typedef struct smoother {
  const tw_topology *t;
  const uint8_t *moves; /* [vertex_count] */
  double (*at)[3];      /* [vertex_count] */
  double (*sums)[3];    /* [vertex_count] sum of the neighbours */
} smoother;

static void step(const smoother *s, double by) {
  const tw_topology *t = s->t;
  memset(s->sums, 0, t->vertex_count * sizeof *s->sums);
  for (uint32_t e = 0; e < t->edge_count; e++)
    for (int end = 0; end < 2; end++) {
      uint32_t p = t->edge_vertices[e][end], other = t->edge_vertices[e][1 - end];
      for (int i = 0; i < 3; i++) s->sums[p][i] += s->at[other][i];
    }
  for (uint32_t p = 0; p < t->vertex_count; p++) {
    if (!s->moves[p]) continue;
    uint32_t neighbours = t->ring_offsets[p + 1] - t->ring_offsets[p];
    for (int i = 0; i < 3; i++) s->at[p][i] += by * (s->sums[p][i] / neighbours - s->at[p][i]);
  }
}

/* Flags the selected points that have neighbours and are not on a border. NULL without memory. */
static const uint8_t *find_moving(const tw_editor *e, const uint8_t *points) {
  const tw_topology *t = e->topology;
  uint8_t *moves = tw_arena_alloc(e->scratch, t->vertex_count, 1);
  if (!moves) return NULL;
  for (uint32_t p = 0; p < t->vertex_count; p++)
    moves[p] = points[p] && t->ring_offsets[p] < t->ring_offsets[p + 1];
  for (uint32_t edge = 0; edge < t->edge_count; edge++)
    if (t->edge_flags[edge] & TW_EDGE_BORDER)
      moves[t->edge_vertices[edge][0]] = moves[t->edge_vertices[edge][1]] = 0;
  return moves;
}

tw_status tw_edit_smooth(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  uint8_t *selected, *points;
  if (edit->smooth.iterations < 1 || edit->smooth.iterations > TW_EDIT_ITERATIONS_MAX)
    return tw_editor_fail(editor, TW_INVALID, "/iterations", "a mesh is smoothed 1 to %d times",
                          TW_EDIT_ITERATIONS_MAX);
  tw_status status = tw_editor_select_points(editor, &selected, &points);
  if (status != TW_OK || !selected) return status;
  status = tw_editor_loosen(editor);
  if (status != TW_OK) return status;
  const tw_topology *t = editor->topology;
  smoother s = {.t = t, .moves = find_moving(editor, points)};
  s.at = tw_arena_alloc_raw(editor->scratch, t->vertex_count, sizeof *s.at);
  s.sums = tw_arena_alloc_raw(editor->scratch, t->vertex_count, sizeof *s.sums);
  if (!s.moves || !s.at || !s.sums) return tw_editor_no_memory(editor);
  for (uint32_t p = 0; p < t->vertex_count; p++)
    for (int i = 0; i < 3; i++) s.at[p][i] = (double)tw_editor_point(editor, p)[i];
  bool is_taubin = edit->smooth.method == TW_SMOOTH_TAUBIN;
  for (uint32_t i = 0; i < edit->smooth.iterations; i++) {
    status = tw_editor_go_on(editor);
    if (status != TW_OK) return status;
    step(&s, is_taubin ? TAUBIN_SHRINK : LAPLACE);
    if (is_taubin) step(&s, TAUBIN_GROW);
  }
  for (uint32_t p = 0; p < t->vertex_count && status == TW_OK; p++)
    if (s.moves[p]) status = tw_editor_place(editor, p, s.at[p]);
  return status == TW_OK ? tw_editor_name_selected(editor, selected, points) : status;
}
