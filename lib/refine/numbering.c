/* Numbers the rows of corners and edges, from which arithmetic finds the row of any point of the answer. */
#include "numbering.h"

#include <stdlib.h>
#include <string.h>

#include "crease.h"
#include "limit.h"
#include "sorted.h"
#include "union_find.h"

static tw_status allocate(const tw_topology *base, tw_arena *arena, uint32_t corners_max, uint32_t edges_max,
                          tw_numbering *n) {
  memset(n, 0, sizeof *n);
  n->corner_row = tw_arena_alloc(arena, base->corner_count, sizeof(uint32_t));
  n->edge_row = tw_arena_alloc(arena, base->corner_count, sizeof(uint32_t));
  n->corner_base = tw_arena_alloc(arena, corners_max, sizeof(uint32_t));
  n->edge_base = tw_arena_alloc(arena, edges_max, sizeof(uint32_t));
  if (!n->corner_row || !n->edge_row || !n->corner_base || !n->edge_base) return TW_NO_MEMORY;
  memset(n->corner_row, 0xFF, base->corner_count * sizeof(uint32_t));
  memset(n->edge_row, 0xFF, base->corner_count * sizeof(uint32_t));
  return TW_OK;
}

static bool runs_against(const tw_topology *base, uint32_t corner, uint32_t representative) {
  return base->corner_vertex[corner] != base->corner_vertex[representative];
}

tw_status tw_number_field(const tw_topology *base, const uint8_t *visible, tw_arena *arena,
                          tw_numbering *out) {
  if (!visible) {
    *out =
        (tw_numbering){.corner_count = base->vertex_count, .edge_count = base->edge_count, .same_as = base};
    return TW_OK;
  }
  tw_status status = allocate(base, arena, base->vertex_count, base->edge_count, out);
  if (status != TW_OK) return status;
  for (uint32_t v = 0; v < base->vertex_count; v++) {
    bool used = false;
    for (uint32_t i = base->fan_offsets[v]; i < base->fan_offsets[v + 1]; i++) {
      uint32_t corner = base->fan_corners[i];
      if (!visible[tw_corner_face(base, corner)]) continue;
      if (!used) out->corner_base[out->corner_count] = corner;
      used = true;
      out->corner_row[corner] = out->corner_count;
    }
    out->corner_count += used;
  }
  for (uint32_t e = 0; e < base->edge_count; e++) {
    bool used = false;
    uint32_t first = base->edge_corner[e], corner = first;
    do {
      if (visible[tw_corner_face(base, corner)]) {
        if (!used) out->edge_base[out->edge_count] = corner;
        used = true;
        out->edge_row[corner] =
            2 * out->edge_count + runs_against(base, corner, out->edge_base[out->edge_count]);
      }
      corner = base->sibling[corner];
    } while (corner != first);
    out->edge_count += used;
  }
  return TW_OK;
}

tw_status tw_number_vertices_as(const tw_topology *base, const uint32_t *vertices, uint32_t rows,
                                tw_arena *arena, tw_numbering *out) {
  tw_status status = allocate(base, arena, rows, 0, out);
  if (status != TW_OK) return status;
  out->corner_count = rows;
  for (uint32_t row = 0; row < rows; row++) {
    uint32_t first = base->fan_offsets[vertices[row]], end = base->fan_offsets[vertices[row] + 1];
    out->corner_base[row] = base->fan_corners[first];
    for (uint32_t i = first; i < end; i++) out->corner_row[base->fan_corners[i]] = row;
  }
  return TW_OK;
}

/* ---- vertices -------------------------------------------------------------------------------- */

typedef struct vertex_numberer {
  const tw_topology *base;
  const tw_splits *splits;
  const uint8_t *visible;
  tw_numbering *out;
  uint32_t *place;           /* [base corners] index of each corner in the fan of its vertex */
  uint32_t *sector;          /* [greatest fan] union-find over the corners of one fan */
  uint32_t *row;             /* [greatest fan] the row of the sector with this root */
  struct fan_entry *entries; /* [greatest fan] */
} vertex_numberer;

/* A corner, with the channels' vertices there. Corners that have equal vertices in all further channels are
 * of one class. */
enum { FIRST_CHANNELS = TW_UV_SETS_MAX };
typedef struct fan_entry {
  uint32_t channels[FIRST_CHANNELS], class, further, frame, normal, sector, corner;
} fan_entry;

static bool has_two_sources(const vertex_numberer *n, uint32_t edge) {
  const tw_topology *t = n->base;
  const uint32_t *sources = n->splits->sources;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  return sources && sources[tw_corner_face(t, one)] != sources[tw_corner_face(t, other)];
}

static bool edge_splits(const vertex_numberer *n, uint32_t edge) {
  return n->splits->normals && (edge < n->splits->sharp_below ||
                                tw_is_infinite(n->base->edge_sharpness[edge]) || has_two_sources(n, edge));
}

static bool is_visible(const vertex_numberer *n, uint32_t corner) {
  return !n->visible || n->visible[tw_corner_face(n->base, corner)];
}

static uint32_t tangent_frame(const vertex_numberer *n, uint32_t corner) {
  return n->splits->tangent_frames ? n->splits->tangent_frames[tw_corner_face(n->base, corner)] : 0;
}

static bool same_edges(const vertex_numberer *n, uint32_t a, uint32_t b) {
  for (uint32_t i = 0; i < n->splits->channel_count; i++)
    if (n->splits->channels[i]->corner_edge[a] != n->splits->channels[i]->corner_edge[b]) return false;
  return tangent_frame(n, a) == tangent_frame(n, b);
}

/* Gives rows to an edge: its corners share a row unless something splits them. With channels, the many
 * corners that may meet at a non-manifold edge are not compared with each other: each gets a row of its own.
 */
static void number_edge(vertex_numberer *n, uint32_t edge) {
  tw_numbering *out = n->out;
  uint32_t first = n->base->edge_corner[edge], corner = first, begun = out->edge_count;
  bool crowded = n->splits->channel_count > 0 && (n->base->edge_flags[edge] & TW_EDGE_NONMANIFOLD);
  bool split = crowded || edge_splits(n, edge);
  do {
    if (is_visible(n, corner)) {
      uint32_t row = begun;
      if (split) row = out->edge_count;
      while (row < out->edge_count && !same_edges(n, corner, out->edge_base[row])) row++;
      if (row == out->edge_count) out->edge_base[out->edge_count++] = corner;
      out->edge_row[corner] = 2 * row + runs_against(n->base, corner, out->edge_base[row]);
    }
    corner = n->base->sibling[corner];
  } while (corner != first);
}

/* Joins the corners of a fan across edges that do not split. Returns the number of sectors. */
static uint32_t find_sectors(vertex_numberer *n, uint32_t vertex) {
  const tw_topology *base = n->base;
  const uint32_t *fan = base->fan_corners + base->fan_offsets[vertex];
  uint32_t count = base->fan_offsets[vertex + 1] - base->fan_offsets[vertex], sectors = count;
  tw_union_find_init(n->sector, count);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t back = tw_corner_previous(base, fan[i]);
    if (edge_splits(n, base->corner_edge[back])) continue;
    uint32_t other = base->sibling[back];
    if (base->corner_vertex[other] != vertex) other = tw_corner_next(base, other);
    sectors -= tw_union_find_join(n->sector, i, n->place[other]);
  }
  return sectors;
}

/* Whether the faces at a vertex are one sector. In a single fan it takes two splitting edges to make two
 * sectors, or one splitting edge besides a border. */
static bool is_one_sector(vertex_numberer *n, uint32_t vertex) {
  const tw_topology *base = n->base;
  if (!n->splits->normals) return true;
  if (base->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD) return find_sectors(n, vertex) == 1;
  uint32_t parting = base->vertex_flags[vertex] & TW_VERTEX_BORDER ? 1 : 0;
  for (uint32_t i = base->ring_offsets[vertex]; i < base->ring_offsets[vertex + 1]; i++) {
    uint32_t edge = base->ring_edges[i];
    parting += !(base->edge_flags[edge] & TW_EDGE_BORDER) && edge_splits(n, edge);
  }
  return parting < 2 || find_sectors(n, vertex) == 1;
}

/* Gives one row to all visible faces at a vertex. */
static void number_whole(vertex_numberer *n, uint32_t vertex) {
  const tw_topology *base = n->base;
  uint32_t row = n->out->corner_count, first = base->fan_offsets[vertex], end = base->fan_offsets[vertex + 1];
  for (uint32_t i = first; i < end; i++) {
    uint32_t corner = base->fan_corners[i];
    if (!is_visible(n, corner)) continue;
    if (n->out->corner_count == row) n->out->corner_base[n->out->corner_count++] = corner;
    n->out->corner_row[corner] = row;
  }
}

static int compare_keys(const fan_entry *a, const fan_entry *b) {
  int channels = memcmp(a->channels, b->channels, sizeof a->channels);
  if (channels != 0) return channels;
  if (a->class != b->class) return a->class < b->class ? -1 : 1;
  if (a->frame != b->frame) return a->frame < b->frame ? -1 : 1;
  if (a->normal != b->normal) return a->normal < b->normal ? -1 : 1;
  return a->sector < b->sector ? -1 : a->sector > b->sector;
}

static int compare_entries(const void *left, const void *right) {
  const fan_entry *a = left, *b = right;
  int keys = compare_keys(a, b);
  if (keys != 0) return keys;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

static int compare_classes(const void *left, const void *right) {
  const fan_entry *a = left, *b = right;
  if (a->class != b->class) return a->class < b->class ? -1 : 1;
  if (a->further != b->further) return a->further < b->further ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* Parts classes by the vertices of one more channel. */
static void part_classes(const tw_topology *channel, fan_entry *entries, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) entries[i].further = channel->corner_vertex[entries[i].corner];
  tw_small_sort(entries, count, sizeof *entries, compare_classes);
  for (uint32_t i = 0, class = 0, before = 0; i < count; i++) {
    bool is_same = i == 0 || (entries[i].class == before && entries[i].further == entries[i - 1].further);
    before = entries[i].class;
    class += !is_same;
    entries[i].class = class;
  }
}

/* Gives each sector with visible faces a row, in the order of their roots. */
static void number_sectors(vertex_numberer *n, uint32_t vertex) {
  const tw_topology *base = n->base;
  tw_numbering *out = n->out;
  const uint32_t *fan = base->fan_corners + base->fan_offsets[vertex];
  uint32_t count = base->fan_offsets[vertex + 1] - base->fan_offsets[vertex], *row_of = n->row;
  for (uint32_t i = 0; i < count; i++) row_of[i] = UINT32_MAX;
  for (uint32_t i = 0; i < count; i++)
    if (is_visible(n, fan[i])) row_of[tw_union_find_root(n->sector, i)] = 0;
  for (uint32_t i = 0; i < count; i++) {
    if (row_of[i] == UINT32_MAX) continue;
    row_of[i] = out->corner_count;
    out->corner_base[out->corner_count++] = UINT32_MAX;
  }
  for (uint32_t i = 0; i < count; i++) {
    if (!is_visible(n, fan[i])) continue;
    uint32_t row = row_of[tw_union_find_root(n->sector, i)];
    out->corner_row[fan[i]] = row;
    if (fan[i] < out->corner_base[row]) out->corner_base[row] = fan[i];
  }
}

static void number_vertex(vertex_numberer *n, uint32_t vertex) {
  const tw_topology *base = n->base;
  tw_numbering *out = n->out;
  const uint32_t *fan = base->fan_corners + base->fan_offsets[vertex];
  uint32_t count = base->fan_offsets[vertex + 1] - base->fan_offsets[vertex], used = 0;
  bool one_sector = is_one_sector(n, vertex);
  const uint32_t *normals = n->splits->own_normals;
  if (n->splits->channel_count == 0 && !n->splits->tangent_frames && !normals) {
    if (one_sector)
      number_whole(n, vertex);
    else
      number_sectors(n, vertex);
    return;
  }
  for (uint32_t i = 0; i < count; i++) {
    if (!is_visible(n, fan[i])) continue;
    fan_entry *entry = &n->entries[used++];
    memset(entry, 0, sizeof *entry);
    entry->corner = fan[i];
    if (!one_sector) entry->sector = tw_union_find_root(n->sector, i);
    entry->frame = tangent_frame(n, fan[i]);
    entry->normal = normals ? normals[fan[i]] : 0;
    for (uint32_t k = 0; k < FIRST_CHANNELS && k < n->splits->channel_count; k++)
      entry->channels[k] = n->splits->channels[k]->corner_vertex[fan[i]];
  }
  for (uint32_t k = FIRST_CHANNELS; k < n->splits->channel_count; k++)
    part_classes(n->splits->channels[k], n->entries, used);
  tw_small_sort(n->entries, used, sizeof *n->entries, compare_entries);
  for (uint32_t i = 0; i < used; i++) {
    if (i == 0 || compare_keys(&n->entries[i], &n->entries[i - 1]) != 0)
      out->corner_base[out->corner_count++] = n->entries[i].corner;
    out->corner_row[n->entries[i].corner] = out->corner_count - 1;
  }
}

/* Numbers the corners at the vertices chosen: [vertices] flags; NULL: at all vertices. */
static tw_status number_corners(vertex_numberer *n, const uint8_t *chosen) {
  const tw_topology *base = n->base;
  uint32_t greatest = 0;
  for (uint32_t v = 0; v < base->vertex_count; v++) {
    uint32_t count = base->fan_offsets[v + 1] - base->fan_offsets[v];
    if (count > greatest) greatest = count;
  }
  n->place = tw_alloc(base->corner_count, sizeof *n->place);
  n->sector = tw_alloc(greatest, sizeof *n->sector);
  n->row = tw_alloc(greatest, sizeof *n->row);
  n->entries = tw_alloc(greatest, sizeof *n->entries);
  bool complete = n->place && n->sector && n->row && n->entries;
  for (uint32_t v = 0; complete && v < base->vertex_count; v++) {
    if (chosen && !chosen[v]) continue;
    uint32_t first = base->fan_offsets[v];
    for (uint32_t i = first; i < base->fan_offsets[v + 1]; i++) n->place[base->fan_corners[i]] = i - first;
    number_vertex(n, v);
  }
  tw_free(n->place);
  tw_free(n->sector);
  tw_free(n->row);
  tw_free(n->entries);
  return complete ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_number_vertices(const tw_topology *base, const tw_splits *splits, const uint8_t *visible,
                             tw_arena *arena, tw_numbering *out) {
  tw_status status = allocate(base, arena, base->corner_count, base->corner_count, out);
  if (status != TW_OK) return status;
  vertex_numberer n = {.base = base, .splits = splits, .visible = visible, .out = out};
  for (uint32_t e = 0; e < base->edge_count; e++) number_edge(&n, e);
  return number_corners(&n, NULL);
}

tw_status tw_number_corners(const tw_topology *base, const tw_splits *splits, const uint8_t *chosen,
                            tw_arena *arena, tw_numbering *out) {
  *out = (tw_numbering){.corner_row = tw_arena_alloc_raw(arena, base->corner_count, sizeof(uint32_t)),
                        .corner_base = tw_arena_alloc_raw(arena, base->corner_count, sizeof(uint32_t))};
  if (!out->corner_row || !out->corner_base) return TW_NO_MEMORY;
  vertex_numberer n = {.base = base, .splits = splits, .out = out};
  return number_corners(&n, chosen);
}

/* ---- what reading costs ---------------------------------------------------------------------- */

/* The time for a mask at a vertex, in faces that are added up. The two sides of a crease have masks of their
 * own: rows of both can come in turn, and computing a mask takes as much again for each step of decay. */
static uint64_t mask_work(const tw_topology *t, uint32_t vertex) {
  uint32_t faces = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  bool has_sides = tw_settled_rule_at(t, vertex, NULL) == TW_RULE_CREASE;
  return faces * (1 + (uint64_t)(has_sides ? tw_limit_steps(t, vertex) : 0));
}

bool tw_is_quickly_read(const tw_topology *base, const tw_numbering *numbering, uint32_t masks) {
  enum { GREAT = 256, WORK_MAX = 1 << 28 };
  uint32_t last = UINT32_MAX;
  uint64_t work = 0, each = 0;
  for (uint32_t row = 0; row < numbering->corner_count && work <= WORK_MAX; row++) {
    uint32_t vertex = base->corner_vertex[tw_corner_of_row(numbering, row)];
    if (vertex == last) { /* rows of a vertex follow each other; the first rows of all take linear time */
      work += each;
      continue;
    }
    last = vertex;
    bool great = base->fan_offsets[vertex + 1] - base->fan_offsets[vertex] >= GREAT;
    each = great ? masks * mask_work(base, vertex) : 0;
  }
  return work <= WORK_MAX;
}
