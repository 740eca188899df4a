/* Clips carried over to other skeletons: invariants that hold whatever the rigs. */
#include "biped.h"
#include "bone_families.h"

#include <stdlib.h>

#include "test.h"

static const double HEIGHT = 1.75;

/* ---- carrying over and posing ---------------------------------------------------------------- */

static tw_skeleton skeleton_of(const biped *b) {
  return (tw_skeleton){.nodes = b->nodes, .order = b->order, .node_count = b->count};
}

static tw_retarget_job job_of(const biped *source, const biped *target) {
  return (tw_retarget_job){.source = skeleton_of(source),
                           .target = skeleton_of(target),
                           .keys = &source->clip,
                           .tolerance = {1e-4, 1e-5},
                           .max_keys = 100000};
}

static tw_retargeted run_good(const tw_retarget_job *job, tw_arena *arena) {
  tw_retargeted out;
  tw_error error = {0};
  tw_status status = tw_retarget_run(job, arena, &out, &error);
  if (status != TW_OK) print_error("%s %s\n", error.pointer, error.detail);
  assert_int_equal(status, TW_OK);
  return out;
}

static void assert_refused(const tw_retarget_job *job, tw_status expected, const char *part) {
  tw_arena *arena = tw_arena_create();
  tw_retargeted out = {.scale = 7};
  tw_error error = {0};
  assert_int_equal(tw_retarget_run(job, arena, &out, &error), expected);
  if (!strstr(error.detail, part)) print_error("%s\n", error.detail);
  assert_non_null(strstr(error.detail, part));
  assert_true(out.scale == 7);
  tw_arena_destroy(arena);
}

typedef struct posed {
  tw_trs locals[BIPED_MOST];
  float world[BIPED_MOST][16];
} posed;

static posed pose_at(const biped *b, const tw_clip_keys *keys, float time) {
  posed out;
  tw_clip *clip = NULL;
  tw_error error = {0};
  tw_status status = tw_clip_create(keys, b->count, -1, &clip, &error);
  if (status != TW_OK) print_error("%s %s\n", error.pointer, error.detail);
  assert_int_equal(status, TW_OK);
  tw_clip_pose(clip, b->nodes, b->count, time, out.locals);
  tw_pose_locals(clip, b->nodes, b->count, out.locals, out.world[0]);
  tw_pose_world(b->nodes, b->order, b->count, out.world[0], out.world[0]);
  tw_clip_destroy(clip);
  return out;
}

/* The farthest that a joint is from `scale` times its place in the other pose, turned about y. */
static double distance_of(const biped *a, const posed *pose_a, const biped *b, const posed *pose_b,
                          uint32_t joint, double scale, double turned) {
  const float *from = &pose_a->world[a->at[joint]][12], *to = &pose_b->world[b->at[joint]][12];
  const double wanted[3] = {scale * ((double)from[0] * cos(turned) + (double)from[2] * sin(turned)),
                            scale * (double)from[1],
                            scale * ((double)from[2] * cos(turned) - (double)from[0] * sin(turned))};
  double sum = 0;
  for (int i = 0; i < 3; i++) sum += ((double)to[i] - wanted[i]) * ((double)to[i] - wanted[i]);
  return sqrt(sum);
}

static const float some_times[] = {0, 0.1f, 0.25f, 0.61f, 1.13f, 1.5f, 1.999f, 2};
enum { TIMES = sizeof some_times / sizeof *some_times };

static const uint32_t ends[] = {8, 9, 12, 13, 17, 22, 0, 5}; /* hands, feet, toes, hips, head */
enum { ENDS = sizeof ends / sizeof *ends };

/* The farthest that hands, feet and head are from where the source has them. */
static double worst_end(const biped *source, const biped *target, const tw_clip_keys *carried, double scale,
                        double turned) {
  double worst = 0;
  for (size_t t = 0; t < TIMES; t++) {
    posed from = pose_at(source, &source->clip, some_times[t]), to = pose_at(target, carried, some_times[t]);
    for (size_t i = 0; i < ENDS; i++)
      worst = fmax(worst, distance_of(source, &from, target, &to, ends[i], scale, turned));
  }
  return worst;
}

/* The same for options of a target, with random clips. */
static double worst_of(biped_options from, biped_options to, double most) {
  static biped source, target;
  double worst = 0;
  for (uint32_t seed = 1; seed < 6; seed++) {
    tw_arena *arena = tw_arena_create();
    biped_make(&source, from);
    biped_make(&target, to);
    biped_animate(&source, most, seed);
    tw_retarget_job job = job_of(&source, &target);
    tw_retargeted out = run_good(&job, arena);
    worst = fmax(worst, worst_end(&source, &target, &out.keys, target.scale / source.scale, to.turned));
    tw_arena_destroy(arena);
  }
  return worst / HEIGHT;
}

/* ---- names ----------------------------------------------------------------------------------- */

TEST(every_family_of_names_matches_every_other_as_a_whole) {
  static biped source, target;
  for (size_t i = 0; i < FAMILIES; i++)
    for (size_t j = 0; j < FAMILIES; j++) {
      tw_arena *arena = tw_arena_create();
      biped_make(&source, (biped_options){.names = families[i]});
      biped_make(&target, (biped_options){.names = families[j]});
      biped_animate(&source, 1, 3);
      tw_retarget_job job = job_of(&source, &target);
      tw_retargeted out = run_good(&job, arena);
      if (out.bone_count != BIPED_JOINTS)
        for (uint32_t k = 0; k < out.without_source_count; k++)
          print_error("%zu on %zu: %s\n", i, j, target.nodes[out.without_source[k]].name);
      assert_int_equal(out.bone_count, BIPED_JOINTS);
      for (uint32_t k = 0; k < out.bone_count; k++) {
        if (out.bones[k].source != out.bones[k].target)
          print_error("%s is not %s\n", source.nodes[out.bones[k].source].name, target.nodes[k].name);
        assert_int_equal(out.bones[k].source, out.bones[k].target);
        if (i == j) assert_int_equal(out.bones[k].by, TW_MATCH_NAME);
      }
      assert_int_equal(out.without_source_count + out.without_target_count, 0);
      tw_arena_destroy(arena);
    }
}

/* Adds another figure of the same build, whose names have another prefix. */
static void add_figure(biped *b, const biped *other) {
  uint32_t first = b->count;
  for (uint32_t i = 0; i < other->count; i++) {
    tw_node *node = &b->nodes[b->count];
    snprintf(b->names[b->count], sizeof b->names[0], "other:%s", other->names[i]);
    *node = other->nodes[i];
    node->name = b->names[b->count++];
    if (node->parent != TW_NO_INDEX) node->parent += first;
  }
  tw_error error;
  assert_int_equal(tw_nodes_order(b->nodes, b->count, b->order, &error), TW_OK);
}

/* A rig with all that steers it, as Blender can export it. */
TEST(bones_that_steer_others_are_none) {
  static const char *const steering[] = {"root",     "hips",        "chest",     "neck",      "head",
                                         "thigh.L",  "thigh_ik.L",  "foot_ik.L", "ORG-spine", "ORG-thigh.L",
                                         "ORG-head", "upper_arm.L", "hand.L"};
  static biped source, target;
  uint32_t count = sizeof steering / sizeof *steering;
  biped_make(&target, (biped_options){.names = rigify});
  memmove(target.nodes + count, target.nodes, target.count * sizeof *target.nodes);
  for (uint32_t i = count + target.count; i-- > 0;) {
    tw_node *node = &target.nodes[i];
    if (i < count)
      *node = (tw_node){
          .name = steering[i], .parent = i ? 0 : TW_NO_INDEX, .mesh = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    else
      node->parent = node->parent == TW_NO_INDEX ? 0 : node->parent + count;
  }
  target.count += count;
  tw_error error;
  assert_int_equal(tw_nodes_order(target.nodes, target.count, target.order, &error), TW_OK);
  for (int i = 0; i < 2; i++) {
    tw_arena *arena = tw_arena_create();
    biped_make(&source, (biped_options){.names = i ? unity : NULL}); /* whose own are "hips", "chest" */
    biped_animate(&source, 1, 3);
    tw_retarget_job job = job_of(&source, &target);
    tw_retargeted out = run_good(&job, arena);
    assert_int_equal(out.bone_count, BIPED_JOINTS);
    for (uint32_t k = 0; k < out.bone_count; k++)
      assert_int_equal(out.bones[k].target, out.bones[k].source + count);
    tw_arena_destroy(arena);
  }
}

TEST(letters_with_numbers_are_vertebrae_only_of_a_spine) {
  static const uint32_t spine[] = {1, 2, 3};
  static biped source, target;
  const char *names[BIPED_JOINTS];
  memcpy(names, mixamo, sizeof names);
  names[9] = "L1", names[13] = "R1"; /* toes, in some program */
  biped_make(&source, (biped_options){.names = unity});
  biped_animate(&source, 1, 3);
  biped_make(&target, (biped_options){.names = names});
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  assert_int_equal(out.bone_count, BIPED_JOINTS - 2);
  for (size_t i = 0; i < 3; i++) assert_int_equal(out.bones[spine[i]].source, spine[i]);
  tw_arena_destroy(arena);
}

TEST(bones_are_those_of_one_figure) {
  static biped source, target, other;
  biped_make(&source, (biped_options){.names = unreal});
  biped_animate(&source, 1, 3);
  biped_make(&other, (biped_options){.names = mixamo});
  for (int is_thin = 0; is_thin < 2; is_thin++) {
    biped_make(&target, (biped_options){.names = mixamo});
    if (is_thin) target.count = 1; /* hips without anything below do not count beside others */
    uint32_t first = is_thin ? 1 : 0;
    add_figure(&target, &other);
    tw_arena *arena = tw_arena_create();
    tw_retarget_job job = job_of(&source, &target);
    tw_retargeted out = run_good(&job, arena);
    assert_int_equal(out.bone_count, BIPED_JOINTS);
    for (uint32_t k = 0; k < out.bone_count; k++)
      assert_int_equal(out.bones[k].target, out.bones[k].source + first);
    tw_arena_destroy(arena);
  }
}

/* ---- invariants ------------------------------------------------------------------------------ */

TEST(on_itself_a_clip_stays_as_it_is) {
  static biped b;
  for (uint32_t seed = 0; seed < 4; seed++) {
    tw_arena *arena = tw_arena_create();
    biped_make(&b, (biped_options){.seed = seed, .has_twists = seed % 2, .arms_down = seed * 0.3});
    biped_animate(&b, 2, seed + 10);
    tw_retarget_job job = job_of(&b, &b);
    tw_retargeted out = run_good(&job, arena);
    assert_true(fabs(out.scale - 1) < 1e-12);
    for (size_t t = 0; t < TIMES; t++) {
      posed was = pose_at(&b, &b.clip, some_times[t]), is = pose_at(&b, &out.keys, some_times[t]);
      for (uint32_t i = 0; i < b.count; i++) {
        const float *p = (const float *)&was.locals[i], *q = (const float *)&is.locals[i];
        float sign = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3] < 0 ? -1 : 1;
        for (int k = 0; k < 10; k++) assert_float_equal(p[k], k < 4 ? sign * q[k] : q[k], 1e-6);
      }
    }
    tw_arena_destroy(arena);
  }
}

TEST(a_scaled_copy_moves_scaled) {
  assert_true(worst_of((biped_options){0}, (biped_options){.scale = 2.5}, 1.5) < 1e-5);
  assert_true(worst_of((biped_options){.scale = 100}, (biped_options){.names = unreal}, 1.5) < 1e-5);
}

TEST(other_names_and_rest_rotations_change_no_place) {
  assert_true(worst_of((biped_options){.seed = 5}, (biped_options){.names = mixamo}, 2) < 1e-5);
  assert_true(worst_of((biped_options){.names = cmu}, (biped_options){.seed = 6, .names = rigify}, 2) < 1e-5);
}

TEST(twist_bones_of_either_figure_move_hands_and_feet_to_the_same_places) {
  assert_true(worst_of((biped_options){0}, (biped_options){.has_twists = true, .seed = 3}, 1.5) < 0.01);
  assert_true(worst_of((biped_options){.names = mixamo, .has_twists = true},
                       (biped_options){.names = unreal, .has_twists = true, .seed = 3}, 0.5) < 0.01);
}

TEST(fewer_and_more_spine_bones_move_hands_and_feet_to_about_the_same_places) {
  for (uint32_t spines = 1; spines < 3; spines++) {
    double fewer = worst_of((biped_options){0}, (biped_options){.spines = spines}, 1);
    double more = worst_of((biped_options){.spines = spines}, (biped_options){0}, 0.5);
    if (fewer > 0.01 || more > 0.01) print_error("%u: %g %g\n", spines, fewer, more);
    assert_true(fewer < 0.01 && more < 0.01);
  }
}

/* Bones that are called after others that the figure lacks match by where they are, and spines that bend at
 * other joints end at the same place. */
TEST(spines_that_lack_any_bones_move_hands_and_feet_to_the_same_places) {
  static const char *const *const names[] = {NULL, mixamo, unreal};
  enum { ALL = (1 << BIPED_NECK) - (1 << BIPED_SPINE) };
  for (size_t i = 0; i < 3; i++)
    for (uint32_t from = 0; from < ALL; from += 1 << BIPED_SPINE)
      for (uint32_t to = 0; to < ALL; to += 1 << BIPED_SPINE) {
        /* Under a sanitizer, once from and once to each. */
        if ((((from + to) >> BIPED_SPINE) + i) % test_stride() != 0) continue;
        double off = worst_of((biped_options){.names = mixamo, .lacks = from},
                              (biped_options){.names = names[i], .seed = 4, .lacks = to}, 1);
        double room = from == to ? 1e-5 : 0.0095;
        if (off > room) print_error("%zu: 0x%x on 0x%x: %g\n", i, from, to, off);
        assert_true(off <= room);
      }
}

/* Puts a figure below a node whose scale undoes the figure's own, as an armature of 0.01 does for
 * centimetres. */
static void shrink(biped *b) {
  float scale = (float)(1 / b->scale);
  b->nodes[b->count] = (tw_node){.name = "Armature",
                                 .parent = TW_NO_INDEX,
                                 .mesh = TW_NO_INDEX,
                                 .skin = TW_NO_INDEX,
                                 .rest = {{0, 0, 0, 1}, {0, 0, 0}, {scale, scale, scale}}};
  b->nodes[0].parent = b->count++;
  tw_error error;
  assert_int_equal(tw_nodes_order(b->nodes, b->count, b->order, &error), TW_OK);
}

TEST(spines_of_figures_in_other_units_below_a_scale_move_to_the_same_places) {
  static biped source, target;
  for (uint32_t lacks = 1 << BIPED_SPINE; lacks < 1 << BIPED_NECK; lacks <<= 1)
    for (int is_target = 0; is_target < 2; is_target++) {
      tw_arena *arena = tw_arena_create();
      biped_make(&source, (biped_options){.names = mixamo, .scale = is_target ? 1 : 100});
      biped_make(&target, (biped_options){.lacks = lacks, .seed = 4, .scale = is_target ? 100 : 1});
      biped_animate(&source, 1, 3);
      shrink(is_target ? &target : &source);
      tw_retarget_job job = job_of(&source, &target);
      tw_retargeted out = run_good(&job, arena);
      double off = worst_end(&source, &target, &out.keys, 1, 0) / HEIGHT;
      if (off > 0.004) print_error("0x%x, %d: %g\n", lacks, is_target, off);
      assert_true(off <= 0.004);
      tw_arena_destroy(arena);
    }
}

/* Puts a node that no name matches, turned and of another scale, between a joint and its parent, so that the
 * joint stays where it is. */
static void hang_lower(biped *b, uint32_t joint) {
  tw_node *child = &b->nodes[b->at[joint]], *between = &b->nodes[b->count];
  static const double back[4] = {-0.6, 0, 0, 0.8};
  double place[3], rotation[4];
  *between = *child;
  between->name = "holder";
  between->rest = (tw_trs){{0.6f, 0, 0, 0.8f}, {1, 2, 3}, {2, 2, 2}};
  for (int i = 0; i < 3; i++)
    place[i] = ((double)child->rest.translation[i] - (double)between->rest.translation[i]) / 2;
  for (int i = 0; i < 4; i++) rotation[i] = (double)child->rest.rotation[i];
  tw_rotation_turn(back, place, place);
  tw_rotation_multiply(back, rotation, rotation);
  for (int i = 0; i < 3; i++) child->rest.translation[i] = (float)place[i];
  for (int i = 0; i < 4; i++) child->rest.rotation[i] = (float)rotation[i];
  for (int i = 0; i < 3; i++) child->rest.scale[i] /= 2;
  child->parent = b->count++;
  tw_error error;
  assert_int_equal(tw_nodes_order(b->nodes, b->count, b->order, &error), TW_OK);
}

/* A spine whose only bone is the uppermost is too short to bend as far as three: its joint moves as far as it
 * takes. Bends of a few degrees move no joint. */
TEST(joints_of_spines_that_are_too_short_for_a_bow_move) {
  static biped source, target;
  for (int is_bow = 0; is_bow < 2; is_bow++)
    for (uint32_t seed = 1; seed < 6; seed++) {
      tw_arena *arena = tw_arena_create();
      biped_make(&source, (biped_options){.names = mixamo});
      biped_make(&target, (biped_options){.lacks = 3 << BIPED_SPINE, .seed = 4, .scale = 100});
      if (seed % 2) hang_lower(&target, BIPED_NECK - 1);
      shrink(&target);
      biped_animate(&source, is_bow ? 4 : 0.2, seed);
      tw_retarget_job job = job_of(&source, &target);
      tw_retargeted out = run_good(&job, arena);
      uint32_t moved = 0;
      for (uint32_t i = 0; i < out.keys.track_count; i++)
        moved += out.keys.tracks[i].path == TW_TRANSLATION && out.keys.tracks[i].node != target.at[0];
      double off = worst_end(&source, &target, &out.keys, 1, 0) / HEIGHT;
      if (off > 0.02) print_error("%d, seed %u: %g\n", is_bow, seed, off);
      assert_true(off <= 0.02); /* 0.08 by turning alone */
      assert_int_equal(moved, is_bow);
      tw_arena_destroy(arena);
    }
}

/* A figure with `count` leaves, called alike in all figures, at the end of a chain below its upper chest. */
static tw_skeleton with_leaves(const biped *b, uint32_t chain, uint32_t count, tw_arena *arena) {
  tw_node *nodes = tw_arena_alloc(arena, b->count + chain + count, sizeof *nodes);
  uint32_t *order = tw_arena_alloc(arena, b->count + chain + count, sizeof *order), made = b->count;
  char(*names)[12] = tw_arena_alloc(arena, count, sizeof *names);
  uint32_t parent = b->at[BIPED_NECK - 1];
  tw_error error;
  assert_true(nodes && order && names);
  memcpy(nodes, b->nodes, b->count * sizeof *nodes);
  for (uint32_t i = 0; i < chain + count; i++) {
    tw_node *node = &nodes[made++];
    *node = b->nodes[b->at[BIPED_NECK]];
    node->parent = parent;
    node->name = NULL;
    if (i < chain) parent = made - 1;
    if (i < chain) continue;
    snprintf(names[i - chain], sizeof *names, "leaf%u", i - chain);
    node->name = names[i - chain];
  }
  assert_int_equal(tw_nodes_order(nodes, made, order, &error), TW_OK);
  return (tw_skeleton){.nodes = nodes, .order = order, .node_count = made};
}

/* What all the leaves would look at together is their product with the chain. */
TEST(leaves_far_below_a_spine_that_swings_are_refused_where_they_are_too_many) {
  static biped source, target;
  biped_make(&source, (biped_options){.names = mixamo});
  biped_make(&target, (biped_options){.names = mixamo, .lacks = 1 << BIPED_SPINE});
  biped_animate(&source, 1, 3);
  for (uint32_t count = 10; count <= 1200; count += 1190) {
    tw_arena *arena = tw_arena_create();
    tw_retarget_job job = job_of(&source, &target);
    job.source = with_leaves(&source, 0, count, arena);
    job.target = with_leaves(&target, count, count, arena);
    if (count > 10)
      assert_refused(&job, TW_LIMIT, "branch too differently");
    else
      run_good(&job, arena);
    tw_arena_destroy(arena);
  }
}

TEST(a_spine_that_does_not_move_stays_at_rest_whatever_its_bones) {
  static biped source, target;
  biped_make(&source, (biped_options){.names = mixamo});
  biped_animate(&source, 1, 3);
  uint32_t kept = 0;
  for (uint32_t i = 0; i < source.clip.track_count; i++) {
    bool is_spine = source.tracks[i].node >= BIPED_SPINE && source.tracks[i].node < BIPED_NECK;
    if (!is_spine) source.tracks[kept++] = source.tracks[i];
  }
  source.clip.track_count = kept;
  for (uint32_t lacks = 1 << BIPED_SPINE; lacks < 1 << BIPED_NECK; lacks <<= 1) {
    tw_arena *arena = tw_arena_create();
    biped_make(&target, (biped_options){.lacks = lacks, .seed = 4});
    tw_retarget_job job = job_of(&source, &target);
    tw_retargeted out = run_good(&job, arena);
    assert_true(worst_end(&source, &target, &out.keys, 1, 0) / HEIGHT < 1e-5);
    tw_arena_destroy(arena);
  }
}

TEST(bones_of_a_spine_keep_their_order_beside_those_of_a_map) {
  static biped source, target;
  const tw_bone_pair map[] = {{.source = 3, .target = 2}};
  biped_make(&source, (biped_options){.names = mixamo});
  biped_make(&target, (biped_options){.names = unreal});
  biped_animate(&source, 1, 3);
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  job.map = map;
  job.map_count = 1;
  tw_retargeted out = run_good(&job, arena);
  assert_int_equal(out.bone_count, BIPED_JOINTS - 1);
  for (uint32_t i = 0; i < out.bone_count; i++) {
    assert_true(out.bones[i].target != 3);
    assert_int_equal(out.bones[i].source, out.bones[i].target == 2 ? 3 : out.bones[i].target);
  }
  tw_arena_destroy(arena);
}

/* The most that a hand, foot, the hips or the head is turned otherwise than in the source: figures that rest
 * alike. Elements of rotation matrices. */
static double worst_turn(biped_options from, biped_options to) {
  static biped source, target;
  double worst = 0;
  tw_arena *arena = tw_arena_create();
  biped_make(&source, from);
  biped_make(&target, to);
  biped_animate(&source, 1.5, 4);
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  for (size_t t = 0; t < TIMES; t++) {
    posed a = pose_at(&source, &source.clip, some_times[t]), b = pose_at(&target, &out.keys, some_times[t]);
    for (size_t i = 0; i < ENDS; i++)
      for (int k = 0; k < 11; k++)
        worst = fmax(worst,
                     fabs((double)a.world[source.at[ends[i]]][k] - (double)b.world[target.at[ends[i]]][k]));
  }
  tw_arena_destroy(arena);
  return worst;
}

TEST(shares_of_bones_in_between_add_up_to_the_whole) {
  for (uint32_t spines = 1; spines < 3; spines++)
    assert_true(worst_turn((biped_options){.spines = spines}, (biped_options){0}) < 1e-3);
  assert_true(worst_turn((biped_options){0}, (biped_options){.has_twists = true}) < 1e-3);
  assert_true(worst_turn((biped_options){.has_twists = true}, (biped_options){.spines = 2}) < 1e-3);
}

TEST(there_and_back_is_the_identity) {
  static biped a, b;
  static const biped_options others[] = {
      {.names = mixamo, .seed = 4},
      {.scale = 0.3, .arms_down = 0.8, .seed = 2},
      {.turned = 3.14159265358979},
      {.arms_down = 1.3, .names = makehuman, .scale = 7, .turned = -1.5707963267949}};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
    tw_arena *arena = tw_arena_create();
    biped_make(&a, (biped_options){.seed = 9});
    biped_make(&b, others[i]);
    biped_animate(&a, 2, 77);
    tw_retarget_job job = job_of(&a, &b);
    tw_retargeted there = run_good(&job, arena);
    tw_retarget_job home = job_of(&b, &a);
    home.keys = &there.keys;
    tw_retargeted back = run_good(&home, arena);
    double worst = worst_end(&a, &a, &back.keys, 1, 0);
    if (!(worst < 1e-4 * HEIGHT)) print_error("%zu: %g\n", i, worst);
    assert_true(worst < 1e-4 * HEIGHT);
    tw_arena_destroy(arena);
  }
}

TEST(arms_that_rest_lower_point_where_the_source_points) {
  static biped source, target;
  biped_make(&source, (biped_options){.seed = 2});
  biped_make(&target, (biped_options){.names = mixamo, .arms_down = 0.9, .seed = 8});
  biped_animate(&source, 1.2, 5);
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  for (uint32_t i = 0; i < out.bone_count; i++) {
    bool is_arm = out.bones[i].target >= 15 && out.bones[i].target != 19;
    float angle = is_arm ? 0.9f : 0;
    assert_float_equal((float)out.bones[i].aligned, angle, 0.02f);
  }
  assert_true(worst_end(&source, &target, &out.keys, 1, 0) < 1e-5 * HEIGHT);
  tw_arena_destroy(arena);
}

TEST(a_figure_that_faces_another_way_moves_as_it_faces) {
  for (int quarter = 1; quarter < 4; quarter++)
    assert_true(worst_of((biped_options){0}, (biped_options){.turned = quarter * 1.5707963267949}, 1) < 1e-5);
}

/* ---- what stands above ----------------------------------------------------------------------- */

/* Gives a node's scale signs, and turns all that is below so that every place stays. */
static void sign_scale(biped *b, uint32_t top, const float signs[3]) {
  bool is_below[BIPED_MOST] = {false};
  float all = signs[0] * signs[1] * signs[2];
  memcpy(b->nodes[top].rest.scale, signs, 3 * sizeof *signs);
  for (uint32_t i = 0; i < b->count; i++) {
    uint32_t node = b->order[i], parent = b->nodes[node].parent;
    is_below[node] = parent != TW_NO_INDEX && (parent == top || is_below[parent]);
    for (int k = 0; is_below[node] && k < 3; k++) {
      b->nodes[node].rest.translation[k] *= signs[k];
      b->nodes[node].rest.rotation[k] *= all * signs[k];
      for (int key = 0; key < BIPED_KEYS; key++) b->turns[node][key][k] *= all * signs[k];
    }
  }
}

/* Hangs a figure on a node of its own. */
static tw_node *hang(biped *b) {
  tw_node *top = &b->nodes[b->count];
  *top = (tw_node){.name = "Armature",
                   .parent = TW_NO_INDEX,
                   .mesh = TW_NO_INDEX,
                   .skin = TW_NO_INDEX,
                   .rest = TW_TRS_IDENTITY};
  b->nodes[0].parent = b->count++;
  tw_error error;
  assert_int_equal(tw_nodes_order(b->nodes, b->count, b->order, &error), TW_OK);
  return top;
}

/* The greatest distance of a hand, a foot or the head from its place in `from`, the source before it got
 * signs, mirrored by these. */
static double worst_below(const biped *from, biped *source, const biped *target, const float signs[3]) {
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(source, target);
  tw_retargeted out = run_good(&job, arena);
  double worst = 0;
  for (size_t t = 0; t < TIMES; t++) {
    posed a = pose_at(from, &from->clip, some_times[t]), b = pose_at(target, &out.keys, some_times[t]);
    for (size_t i = 0; i < ENDS; i++)
      for (int k = 0; k < 3; k++)
        worst = fmax(worst, fabs((double)(a.world[from->at[ends[i]]][12 + k] -
                                          signs[k] * b.world[target->at[ends[i]]][12 + k])));
  }
  tw_arena_destroy(arena);
  return worst;
}

/* A source and a target of the same build, and the source as it was made. */
static void make_pair(biped *from, biped *source, biped *target) {
  biped_make(source, (biped_options){.seed = 5});
  biped_animate(source, 1.5, 3);
  biped_make(from, (biped_options){.seed = 5});
  biped_animate(from, 1.5, 3);
  biped_make(target, (biped_options){.names = mixamo, .seed = 8});
}

TEST(signs_of_scales_change_no_place) {
  static const float none[3] = {1, 1, 1}, signs[][3] = {{-1, 1, 1}, {1, -1, -1}, {-1, -1, -1}, {1, -1, 1}};
  static const uint32_t tops[] = {0, 2, 7, 20};
  static biped from, source, target;
  for (size_t i = 0; i < sizeof signs / sizeof *signs; i++)
    for (size_t k = 0; k < sizeof tops / sizeof *tops; k++) {
      make_pair(&from, &source, &target);
      sign_scale(&source, tops[k], signs[i]);
      assert_true(worst_below(&from, &source, &target, none) < 1e-5);
      sign_scale(&target, tops[k], signs[(i + 1) % 4]);
      assert_true(worst_below(&from, &source, &target, none) < 1e-5);
    }
}

TEST(mirrored_figures_move_as_their_mirror_images) {
  static const float none[3] = {1, 1, 1}, signs[][3] = {{-1, 1, 1}, {-1, -1, -1}, {1, 1, -1}};
  static biped from, source, target;
  for (size_t i = 0; i < sizeof signs / sizeof *signs; i++) {
    make_pair(&from, &source, &target);
    memcpy(hang(&source)->rest.scale, signs[i], sizeof signs[i]);
    assert_true(worst_below(&from, &source, &target, none) < 1e-5);
    memcpy(hang(&target)->rest.scale, signs[i], sizeof signs[i]);
    assert_true(worst_below(&from, &source, &target, signs[i]) < 1e-5);
  }
}

TEST(on_itself_a_clip_stays_below_shear_and_a_scale_of_0) {
  static const float none[3] = {1, 1, 1}, shear[16] = {1, 0.5f, 0, 0, 0, 1, 0, 0, 0.2f, 0, 1, 0, 0, 3, 0, 1};
  static biped source, target;
  for (int i = 0; i < 2; i++) {
    make_pair(&source, &source, &target);
    tw_node *top = hang(&source);
    if (i == 0) {
      top->has_matrix = true;
      memcpy(top->matrix, shear, sizeof shear);
      tw_trs_from_matrix(shear, &top->rest);
    } else {
      top->rest.scale[2] = 0;
    }
    assert_true(worst_below(&source, &source, &source, none) < 1e-5);
  }
}

/* The nodes above the hips of both figures are scaled by the clip, unevenly. */
TEST(a_scale_that_moves_above_the_hips_moves_them_as_far_as_in_the_source) {
  static const float none[3] = {1, 1, 1}, rests[2][3] = {{1, 1, 1}, {100, 100, 100}};
  static biped source, target;
  static float scales[BIPED_KEYS][3];
  for (int i = 0; i < 2; i++) {
    make_pair(&source, &source, &target);
    memcpy(hang(&source)->rest.scale, rests[i], sizeof rests[i]);
    memcpy(hang(&target)->rest.scale, rests[0], sizeof rests[0]);
    for (int k = 0; k < BIPED_KEYS; k++)
      for (int axis = 0; axis < 3; axis++)
        scales[k][axis] = rests[i][axis] * (1 + 0.1F * (float)k * (float)(axis - 1));
    tw_track_keys *scale = &source.tracks[source.clip.track_count++];
    *scale = source.tracks[source.clip.track_count - 2];
    scale->node = source.count - 1;
    scale->path = TW_SCALE;
    scale->values = scales[0];
    assert_true(worst_below(&source, &source, &source, none) < 1e-3 * (double)rests[i][0]);
    tw_arena *arena = tw_arena_create();
    tw_retarget_job job = job_of(&source, &target);
    tw_retargeted out = run_good(&job, arena);
    assert_true(worst_end(&source, &target, &out.keys, 1 / (double)rests[i][0], 0) < 1e-3);
    tw_arena_destroy(arena);
  }
}

/* The chest moves in its parent, and is scaled, which goes over where the bones rest alike. */
TEST(translations_of_bones_go_over_between_figures_in_other_units_below_a_scale) {
  static biped source, target;
  static float moves[BIPED_KEYS][3], scales[BIPED_KEYS][3];
  for (int is_target = 0; is_target < 2; is_target++) {
    biped_make(&source, (biped_options){.scale = is_target ? 1 : 100});
    biped_make(&target, (biped_options){.scale = is_target ? 100 : 1});
    biped_animate(&source, 1, 3);
    uint32_t chest = source.at[2], used = source.clip.track_count;
    for (int k = 0; k < BIPED_KEYS; k++)
      for (int axis = 0; axis < 3; axis++) {
        moves[k][axis] = source.nodes[chest].rest.translation[axis] + 0.01F * (float)(source.scale * k);
        scales[k][axis] = 1 + 0.05F * (float)k;
      }
    source.tracks[used] = source.tracks[used + 1] = source.tracks[used - 1];
    source.tracks[used].node = source.tracks[used + 1].node = chest;
    source.tracks[used].values = moves[0];
    source.tracks[used + 1].values = scales[0];
    source.tracks[used + 1].path = TW_SCALE;
    source.clip.track_count = used + 2;
    shrink(is_target ? &target : &source);
    tw_arena *arena = tw_arena_create();
    tw_retarget_job job = job_of(&source, &target);
    tw_retargeted out = run_good(&job, arena);
    assert_int_equal(out.lost_count, 0);
    assert_true(worst_end(&source, &target, &out.keys, 1, 0) < 1e-3);
    tw_arena_destroy(arena);
  }
}

/* Tracks that leave a bone where it rests lose nothing where the target's bone rests otherwise, splines too.
 */
TEST(splines_that_rest_are_not_told_as_lost) {
  static biped source, target;
  static float rows[BIPED_KEYS][3][3]; /* in-tangent, value, out-tangent */
  biped_make(&source, (biped_options){0});
  biped_make(&target, (biped_options){.names = mixamo, .seed = 4});
  biped_animate(&source, 1, 3);
  uint32_t chest = source.at[2];
  for (int k = 0; k < BIPED_KEYS; k++)
    memcpy(rows[k][1], source.nodes[chest].rest.translation, sizeof rows[k][1]);
  tw_track_keys *track = &source.tracks[source.clip.track_count++];
  *track = source.tracks[source.clip.track_count - 2];
  track->node = chest;
  track->interpolation = TW_CUBICSPLINE;
  track->values = rows[0][0];
  for (uint32_t moves = 0; moves < 2; moves++) {
    rows[3][2][1] = (float)moves; /* between keys alone */
    tw_arena *arena = tw_arena_create();
    tw_retarget_job job = job_of(&source, &target);
    assert_int_equal(run_good(&job, arena).lost_count, moves);
    tw_arena_destroy(arena);
  }
}

/* Rests with the legs folded up; the clip, whose first pose is a T-pose that faces elsewhere, is as it was.
 */
static void fold(biped *b) {
  static const uint32_t thighs[] = {6, 10};
  static const float up[4] = {1, 0, 0, 0};
  for (int side = 0; side < 2; side++) memcpy(b->nodes[b->at[thighs[side]]].rest.rotation, up, sizeof up);
}

static void begin_in_t_pose(biped *b) {
  static const float none[4] = {0, 0, 0, 1}, turned[4] = {0, 0.6F, 0, 0.8F};
  for (uint32_t i = 0; i < b->count; i++) memcpy(b->turns[i][0], i == 0 ? turned : none, sizeof none);
}

/* Turns the clip's world so that z is up. */
static void lay_down(biped *b) {
  static const double back[4] = {0.70710678118654752, 0, 0, 0.70710678118654752};
  for (int key = 0; key < BIPED_KEYS; key++) {
    double q[4], out[4], place[3];
    for (int k = 0; k < 4; k++) q[k] = (double)b->turns[0][key][k];
    for (int k = 0; k < 3; k++) place[k] = (double)b->places[key][k];
    tw_rotation_multiply(back, q, out);
    tw_rotation_turn(back, place, place);
    for (int k = 0; k < 4; k++) b->turns[0][key][k] = (float)out[k];
    for (int k = 0; k < 3; k++) b->places[key][k] = (float)place[k];
  }
}

TEST(a_figure_that_rests_folded_is_carried_over_as_it_stands) {
  static const float none[3] = {1, 1, 1};
  static biped from, source, target;
  for (int is_down = 0; is_down < 2; is_down++) {
    biped_make(&from, (biped_options){0});
    biped_animate(&from, 1.5, 3);
    begin_in_t_pose(&from);
    biped_make(&source, (biped_options){0});
    biped_animate(&source, 1.5, 3);
    begin_in_t_pose(&source);
    biped_make(&target, (biped_options){.names = mixamo, .seed = 8});
    fold(&source);
    if (is_down) lay_down(&source);
    for (int k = 0; k < 3; k++) source.nodes[0].rest.translation[k] = 0; /* as motion capture has it */
    double worst = worst_below(&from, &source, &target, none);
    if (worst > 0.02) print_error("%d: %g\n", is_down, worst);
    assert_true(worst < 0.02); /* hips that rest at the origin are as high as the legs are long */
    assert_true(worst_below(&source, &source, &source, none) < 1e-5);
  }
}

/* ---- tracks ---------------------------------------------------------------------------------- */

TEST(keys_of_one_joint_are_carried_over_one_by_one) {
  static biped source, target;
  static float splines[BIPED_KEYS][3][4];
  biped_make(&source, (biped_options){.seed = 2});
  biped_make(&target, (biped_options){.names = mixamo, .seed = 8});
  biped_animate(&source, 1.2, 5);
  for (int k = 0; k < BIPED_KEYS; k++)
    for (int i = 0; i < 4; i++) {
      splines[k][0][i] = splines[k][2][i] = 0.3f * (float)((k + i) % 3 - 1);
      splines[k][1][i] = source.turns[7][k][i];
    }
  source.tracks[7].interpolation = TW_CUBICSPLINE;
  source.tracks[7].values = splines[0][0];
  source.tracks[16].interpolation = TW_STEP;
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  assert_int_equal(out.keys.track_count, source.clip.track_count);
  for (uint32_t i = 0; i < out.keys.track_count; i++) {
    const tw_track_keys *track = &out.keys.tracks[i];
    assert_int_equal(track->key_count, BIPED_KEYS);
    if (track->path != TW_ROTATION) continue;
    assert_int_equal(track->interpolation, track->node == 7    ? TW_CUBICSPLINE
                                           : track->node == 16 ? TW_STEP
                                                               : TW_LINEAR);
  }
  assert_true(worst_end(&source, &target, &out.keys, 1, 0) < 1e-5 * HEIGHT);
  tw_arena_destroy(arena);
}

TEST(angles_are_carried_over_within_the_tolerance) {
  static biped source, target;
  static double eulers[BIPED_KEYS][3];
  biped_make(&source, (biped_options){0});
  biped_make(&target, (biped_options){.names = mixamo, .seed = 8});
  biped_animate(&source, 1.2, 5);
  uint32_t seed = 3;
  for (int k = 0; k < BIPED_KEYS; k++)
    for (int i = 0; i < 3; i++) eulers[k][i] = 2 * biped_random(&seed) - 1;
  for (uint32_t i = 14; i < 18; i++)
    source.tracks[i] = (tw_track_keys){.node = source.tracks[i].node,
                                       .path = TW_ROTATION,
                                       .interpolation = i == 14 ? TW_LINEAR : TW_EULER,
                                       .form = TW_KEY_EULER,
                                       .order = TW_ZXY,
                                       .width = 3,
                                       .key_count = BIPED_KEYS,
                                       .times = source.times,
                                       .angles = eulers[0]};
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  assert_true(worst_end(&source, &target, &out.keys, 1, 0) < 1e-3 * HEIGHT);
  tw_arena_destroy(arena);
}

/* A node above the hips moves the figure: its target has no such node. */
TEST(what_moves_above_the_hips_moves_them) {
  static biped source, target;
  static float moves[BIPED_KEYS][3], turns[BIPED_KEYS][4];
  biped_make(&source, (biped_options){0});
  biped_make(&target, (biped_options){.names = mixamo, .seed = 8, .scale = 2});
  biped_animate(&source, 1.2, 5);
  uint32_t root = source.count++, used = source.clip.track_count;
  source.nodes[root] = (tw_node){.name = "walker",
                                 .parent = TW_NO_INDEX,
                                 .mesh = TW_NO_INDEX,
                                 .skin = TW_NO_INDEX,
                                 .rest = TW_TRS_IDENTITY};
  source.nodes[0].parent = root;
  tw_error error;
  assert_int_equal(tw_nodes_order(source.nodes, source.count, source.order, &error), TW_OK);
  for (int k = 0; k < BIPED_KEYS; k++) {
    moves[k][0] = (float)k;
    turns[k][1] = sinf(0.2f * (float)k);
    turns[k][3] = cosf(0.2f * (float)k);
  }
  source.tracks[used] = source.tracks[used - 1];
  source.tracks[used].node = root;
  source.tracks[used++].values = moves[0];
  source.tracks[used] = source.tracks[0];
  source.tracks[used].node = root;
  source.tracks[used++].values = turns[0];
  source.clip.track_count = used;
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  job.tolerance.distance = 1e-4;
  tw_retargeted out = run_good(&job, arena);
  assert_true(worst_end(&source, &target, &out.keys, 2, 0) < 1e-3 * HEIGHT);
  tw_arena_destroy(arena);
}

/* Motion capture has its hips at the origin at rest, and their height in the frames. */
TEST(hips_that_rest_at_the_origin_are_as_high_as_the_legs_are_long) {
  static biped source, target;
  biped_make(&source, (biped_options){.scale = 10});
  biped_make(&target, (biped_options){.names = mixamo});
  biped_animate(&source, 1, 5);
  memset(source.nodes[0].rest.translation, 0, sizeof source.nodes[0].rest.translation);
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  assert_true(fabs(out.scale - 0.1) < 1e-6);
  assert_true(worst_end(&source, &target, &out.keys, 0.1, 0) < 0.011 * HEIGHT); /* the toes are 1 cm high */
  tw_arena_destroy(arena);
}

/* ---- refusals -------------------------------------------------------------------------------- */

TEST(strangers_are_refused_with_names) {
  static biped source, target;
  static const char *odd[BIPED_JOINTS];
  static char texts[BIPED_JOINTS][16];
  for (int i = 0; i < BIPED_JOINTS; i++) {
    snprintf(texts[i], sizeof texts[i], "part%c", 'A' + i);
    odd[i] = texts[i];
  }
  biped_make(&source, (biped_options){.names = mixamo});
  biped_make(&target, (biped_options){.names = odd});
  biped_animate(&source, 1, 5);
  tw_retarget_job job = job_of(&source, &target);
  assert_refused(&job, TW_UNSUPPORTED, "0 of 24 bones match");
  assert_refused(&job, TW_UNSUPPORTED, "mixamorig:Spine");
  assert_refused(&job, TW_UNSUPPORTED, "partA");
  tw_bone_pair map[12];
  for (uint32_t i = 0; i < 12; i++) map[i] = (tw_bone_pair){2 * i, 2 * i};
  job.map = map;
  job.map_count = 11;
  assert_refused(&job, TW_UNSUPPORTED, "11 of 24");
  job.map_count = 12;
  tw_arena *arena = tw_arena_create();
  tw_retargeted out = run_good(&job, arena);
  assert_int_equal(out.bone_count, 12);
  for (uint32_t i = 0; i < 12; i++) assert_int_equal(out.bones[i].by, TW_MATCH_MAP);
  tw_arena_destroy(arena);
}

TEST(bad_maps_and_bare_models_are_refused) {
  static biped source, target;
  biped_make(&source, (biped_options){0});
  biped_make(&target, (biped_options){0});
  biped_animate(&source, 1, 5);
  tw_retarget_job job = job_of(&source, &target);
  static const tw_bone_pair maps[][2] = {
      {{0, 1}, {0, 2}}, {{0, 1}, {2, 1}}, {{0, 1}, {99, 3}}, {{0, 1}, {3, 99}}};
  job.map_count = 2;
  for (size_t i = 0; i < sizeof maps / sizeof *maps; i++) {
    job.map = maps[i];
    assert_refused(&job, TW_INVALID, "entry 1 of the map");
  }
  job.map_count = 0;
  job.target.node_count = 1;
  assert_refused(&job, TW_UNSUPPORTED, "the model has no skeleton");
}

TEST(a_map_may_leave_a_bone_out) {
  static biped source, target;
  biped_make(&source, (biped_options){0});
  biped_make(&target, (biped_options){.names = mixamo});
  biped_animate(&source, 1, 5);
  tw_retarget_job job = job_of(&source, &target);
  const tw_bone_pair map[] = {{5, TW_NO_INDEX}, {17, 22}, {22, 17}};
  job.map = map;
  job.map_count = 3;
  tw_arena *arena = tw_arena_create();
  tw_retargeted out = run_good(&job, arena);
  assert_int_equal(out.bone_count, BIPED_JOINTS - 1);
  assert_int_equal(out.without_target_count, 1);
  assert_int_equal(out.without_target[0], 5);
  assert_int_equal(out.without_source_count, 1);
  assert_int_equal(out.without_source[0], 5);
  tw_arena_destroy(arena);
}

/* Whichever bone it is: the others move as if the clip did not move that one. */
TEST(bones_that_the_map_leaves_out_need_no_counterpart) {
  enum { FEW = 10, OTHERS = BIPED_JOINTS - FEW };
  static biped source, target;
  static char strange[OTHERS][16];
  const char *names[BIPED_JOINTS];
  tw_bone_pair map[OTHERS];
  memcpy(names, mixamo, sizeof names);
  for (uint32_t i = 0; i < OTHERS; i++) {
    snprintf(strange[i], sizeof strange[i], "strange %c", 'a' + (int)i);
    names[FEW + i] = strange[i];
    map[i] = (tw_bone_pair){.source = FEW + i, .target = TW_NO_INDEX};
  }
  biped_make(&source, (biped_options){.names = names});
  biped_make(&target, (biped_options){.names = unreal});
  biped_animate(&source, 1, 3);
  tw_retarget_job job = job_of(&source, &target);
  assert_refused(&job, TW_UNSUPPORTED, "10 of 24 bones match");
  job.map = map;
  job.map_count = OTHERS;
  tw_arena *arena = tw_arena_create();
  assert_int_equal(run_good(&job, arena).bone_count, FEW);
  tw_arena_destroy(arena);
}

TEST(a_bone_that_the_map_leaves_out_moves_nothing) {
  static biped source, resting, target;
  biped_make(&source, (biped_options){.seed = 2});
  biped_make(&resting, (biped_options){.seed = 2});
  biped_make(&target, (biped_options){.names = mixamo, .seed = 3});
  biped_animate(&source, 1, 5);
  for (uint32_t left = 0; left < BIPED_JOINTS; left++) {
    resting.clip = (tw_clip_keys){.tracks = resting.tracks};
    for (uint32_t i = 0; i < source.clip.track_count; i++)
      if (source.tracks[i].node != left) resting.tracks[resting.clip.track_count++] = source.tracks[i];
    const tw_bone_pair map = {left, TW_NO_INDEX};
    tw_retarget_job job = job_of(&source, &target), still = job_of(&resting, &target);
    job.map = still.map = &map;
    job.map_count = still.map_count = 1;
    tw_arena *arena = tw_arena_create();
    tw_retargeted out = run_good(&job, arena), expected = run_good(&still, arena);
    for (size_t t = 0; t < TIMES; t++) {
      posed got = pose_at(&target, &out.keys, some_times[t]);
      posed wanted = pose_at(&target, &expected.keys, some_times[t]);
      assert_memory_equal(got.world, wanted.world, target.count * sizeof *got.world);
    }
    assert_int_equal(out.without_target_count, 1);
    assert_int_equal(out.without_target[0], left);
    assert_int_equal(expected.without_target_count, 0);
    tw_arena_destroy(arena);
  }
}

TEST(a_name_that_means_two_bones_does_not_match_itself) {
  static biped source, target;
  biped_make(&source, (biped_options){.names = anatomy});
  biped_make(&target, (biped_options){.names = cmu});
  biped_animate(&source, 1, 5);
  tw_arena *arena = tw_arena_create();
  tw_retarget_job job = job_of(&source, &target);
  tw_retargeted out = run_good(&job, arena);
  for (uint32_t i = 0; i < out.bone_count; i++)
    if (strcmp(target.nodes[out.bones[i].target].name, "LeftShoulder") == 0)
      assert_string_equal(source.nodes[out.bones[i].source].name, "LeftCollar");
  tw_arena_destroy(arena);
}

/* Of two claws the first ones match, and the second ones; where the first is no bone, as a mesh that is
 * called like one, the bones match all the same. */
TEST(bones_of_one_name_match_in_their_order_before_what_is_no_bone) {
  static biped source, target;
  const char *names[BIPED_JOINTS];
  for (uint32_t i = 0; i < BIPED_JOINTS; i++) names[i] = biped_joints[i].name;
  names[18] = names[23] = "claw";
  biped_make(&source, (biped_options){.names = names});
  biped_make(&target, (biped_options){.names = names});
  biped_animate(&source, 1, 5);
  bool is_bone[2][BIPED_MOST];
  memset(is_bone, true, sizeof is_bone);
  for (int form = 0; form < 4; form++) { /* which of both figures has a first claw that is no bone */
    tw_arena *arena = tw_arena_create();
    tw_retarget_job job = job_of(&source, &target);
    job.source.is_bone = is_bone[0];
    job.target.is_bone = is_bone[1];
    for (int i = 0; i < 2; i++) is_bone[i][source.at[18]] = !(form >> i & 1);
    tw_retargeted out = run_good(&job, arena);
    bool is_crossed = form == 1 || form == 2; /* the bone of one is the second, of the other the first claw */
    uint32_t claws = 0;
    for (uint32_t i = 0; i < out.bone_count; i++) {
      bool is_claw = out.bones[i].target == target.at[18] || out.bones[i].target == target.at[23];
      claws += is_claw;
      if (!is_claw || !is_crossed) assert_int_equal(out.bones[i].source, out.bones[i].target);
    }
    assert_true(claws == 2 && out.bone_count == BIPED_JOINTS);
    tw_arena_destroy(arena);
  }
}
