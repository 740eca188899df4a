/* Despike: moves points that stand out from their neighbours back among them.
 *
 * The middle of a point's neighbours is the median of each coordinate; their spread is the median of their
 * distances from it. Medians keep a second spike beside the point from distorting the measure. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "editor.h"
#include "order.h"

typedef struct finder {
  const tw_editor *editor;
  const tw_topology *t;
  double *values; /* scratch, [the largest number of neighbours] */
} finder;

static double median(double *values, uint32_t count) {
  qsort(values, count, sizeof *values, tw_order_doubles);
  return (values[(count - 1) / 2] + values[count / 2]) / 2;
}

static const float *neighbour(const finder *f, uint32_t point, uint32_t i) {
  uint32_t edge = f->t->ring_edges[f->t->ring_offsets[point] + i];
  return tw_editor_point(f->editor, tw_far_end(f->t, edge, point));
}

static double distance(const float *point, const double *from) {
  double side[3];
  for (int i = 0; i < 3; i++) side[i] = (double)point[i] - from[i];
  return tw_length3(side);
}

/* Two neighbours are not enough to tell a spike. */
static bool is_spike(const finder *f, uint32_t point) {
  uint32_t count = f->t->ring_offsets[point + 1] - f->t->ring_offsets[point];
  double middle[3];
  if (count < 3) return false;
  for (int i = 0; i < 3; i++) {
    for (uint32_t n = 0; n < count; n++) f->values[n] = (double)neighbour(f, point, n)[i];
    middle[i] = median(f->values, count);
  }
  for (uint32_t n = 0; n < count; n++) f->values[n] = distance(neighbour(f, point, n), middle);
  return distance(tw_editor_point(f->editor, point), middle) >
         f->editor->edit->despike.factor * median(f->values, count);
}

/* Numbers spikes by their distance in edges from the nearest point that is no spike, and queues them, nearest
 * first. layers: [vertex_count], UINT32_MAX for spikes and 0 for others. queue: [vertex_count]; returns how
 * many it holds. */
static uint32_t reach_spikes(const tw_topology *t, uint32_t *layers, uint32_t *queue) {
  uint32_t queued = 0;
  for (uint32_t p = 0; p < t->vertex_count; p++)
    if (layers[p] == 0 && t->ring_offsets[p] < t->ring_offsets[p + 1]) queue[queued++] = p;
  uint32_t first = queued;
  for (uint32_t i = 0; i < queued; i++)
    for (uint32_t k = t->ring_offsets[queue[i]]; k < t->ring_offsets[queue[i] + 1]; k++) {
      uint32_t other = tw_far_end(t, t->ring_edges[k], queue[i]);
      if (layers[other] != UINT32_MAX) continue;
      layers[other] = layers[queue[i]] + 1;
      queue[queued++] = other;
    }
  memmove(queue, queue + first, (queued - first) * sizeof *queue);
  return queued - first;
}

/* Moves a spike to the mean of the neighbours on lower layers, whose positions are final. */
static tw_status put_back(tw_editor *e, uint32_t point, const uint32_t *layers) {
  const tw_topology *t = e->topology;
  double mean[3] = {0, 0, 0};
  uint32_t count = 0;
  for (uint32_t k = t->ring_offsets[point]; k < t->ring_offsets[point + 1]; k++) {
    uint32_t other = tw_far_end(t, t->ring_edges[k], point);
    if (layers[other] >= layers[point]) continue;
    for (int i = 0; i < 3; i++) mean[i] += (double)tw_editor_point(e, other)[i];
    count++;
  }
  for (int i = 0; i < 3; i++) mean[i] /= count;
  return tw_editor_place(e, point, mean);
}

tw_status tw_edit_despike(tw_editor *editor) {
  double factor = editor->edit->despike.factor;
  uint8_t *selected, *points;
  uint32_t most = 0;
  if (!(factor > 0 && isfinite(factor)))
    return tw_editor_fail(editor, TW_INVALID, "/factor", "a factor is a number above 0");
  tw_status status = tw_editor_select_points(editor, &selected, &points);
  if (status != TW_OK || !selected) return status;
  status = tw_editor_loosen(editor);
  if (status != TW_OK) return status;
  const tw_topology *t = editor->topology;
  for (uint32_t p = 0; p < t->vertex_count; p++)
    if (t->ring_offsets[p + 1] - t->ring_offsets[p] > most)
      most = t->ring_offsets[p + 1] - t->ring_offsets[p];
  uint32_t *layers = tw_arena_alloc(editor->scratch, t->vertex_count, sizeof *layers);
  uint32_t *queue = tw_arena_alloc_raw(editor->scratch, t->vertex_count, sizeof *queue);
  uint8_t *moved = tw_arena_alloc(editor->scratch, t->vertex_count, 1);
  finder f = {editor, t, tw_arena_alloc_raw(editor->scratch, most, sizeof *f.values)};
  if (!layers || !queue || !moved || !f.values) return tw_editor_no_memory(editor);
  for (uint32_t p = 0; p < t->vertex_count; p++)
    if (points[p] && is_spike(&f, p)) layers[p] = UINT32_MAX;
  uint32_t count = reach_spikes(t, layers, queue);
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    status = put_back(editor, queue[i], layers);
    moved[queue[i]] = 1;
  }
  tw_named *named = NULL;
  if (status == TW_OK) status = tw_editor_name_own(editor, &named);
  if (status != TW_OK || !named) return status;
  named->points = tw_list_flagged(named->arena, moved, 1, t->vertex_count, &named->point_count);
  return named->points ? TW_OK : tw_editor_no_memory(editor);
}
