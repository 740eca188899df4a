/* Every allocation of the readers, of compiling a clip and of making a surface fails once: each time the
 * answer is TW_NO_MEMORY or, where a part may be lost, a whole model; nothing leaks (the sanitizer looks).
 * What C++ allocates inside its library is not reached. */
#include "biped.h"
#include "cube.h"
#include "glb.h"
#include "keys.h"
#include "surface_rows.h"
#include "tweend/detail.h"
#include "wrapped_memory.h"

typedef tw_status read_fn(const uint8_t *bytes, size_t size, tw_model **model, tw_error *error);

static tw_status read_gltf(const uint8_t *bytes, size_t size, tw_model **model, tw_error *error) {
  return tw_gltf_read(bytes, size, TW_QUADS_AUTO, TW_WELD_AUTO, 0, model, error);
}

static tw_status read_obj(const uint8_t *bytes, size_t size, tw_model **model, tw_error *error) {
  tw_status status = tw_obj_read(bytes, size, TW_WELD_AUTO, model, error);
  if (status != TW_OK) return status;
  status = tw_model_weld(*model, 0.25, error);
  if (status == TW_OK) return status;
  tw_model_destroy(*model);
  *model = NULL;
  return status;
}

/* Fails the first allocation, then the second, until reading passes through without one failing. */
static void fail_each(read_fn *read, const uint8_t *bytes, size_t size) {
  size_t failures = 0;
  for (size_t n = 0;; n++) {
    tw_model *model = NULL;
    tw_error error = {0};
    test_memory.left = n;
    tw_status status = read(bytes, size, &model, &error);
    bool failed = test_memory.left == SIZE_MAX;
    test_memory.left = SIZE_MAX;
    if (status == TW_OK) {
      tw_model_destroy(model);
    } else {
      if (status != TW_NO_MEMORY) fail_msg("%s", error.detail);
      assert_null(model);
      failures++;
    }
    if (!failed) break;
  }
  assert_true(failures > 10);
}

TEST(obj_reading_survives_every_failure) {
  static const char text[] =
      "o a\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nusemtl red\n"
      "vn 0 0 1\ns 1\nf 1/1/1 2/1 3/1 4/1\nl 1 2\no b\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 5 6 7\n";
  static const char tagged[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt crease 2/1/0 0 1 2\n"
                               "t corner 1/1/0 0 1\nt hole 1/0/0 0\n";
  static const char colored[] = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0 1 0 0\nv 1 0 0 0 0 1\n"
                                "v 2 0 0 0 0 1\nv 2 1 0 0 0 1\nv 1 1 0 0 0 1\nf 1 2 3 4\nf 5 6 7 8\n";
  fail_each(read_obj, (const uint8_t *)text, sizeof text - 1);
  fail_each(read_obj, (const uint8_t *)colored, sizeof colored - 1);
  fail_each(read_obj, (const uint8_t *)tagged, sizeof tagged - 1);
}

TEST(bvh_reading_survives_every_failure) {
  static const char text[] =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 7 Xposition Yposition Zposition Zrotation Xrotation "
      "Yrotation "
      "Xscale\nJOINT b\n{\nCHANNELS 1 Xrotation\nEnd Site x\n{\nOFFSET 0 1 0\n}\n}\n}\nMOTION\nFrames: 3\n"
      "Frame Time: 0.1\n1 2 3 4 5 6 7 8\n9 10 11 12 13 14 300 16\n1 2";
  fail_each(tw_bvh_read, (const uint8_t *)text, sizeof text - 1);
}

static void carry_with_failures(const tw_retarget_job *job, uint32_t bones, uint32_t feet) {
  tw_status status = TW_NO_MEMORY;
  for (size_t failures = 0; status != TW_OK; failures++) {
    tw_arena *arena = tw_arena_create();
    tw_retargeted out = {0};
    test_memory.left = failures;
    status = tw_retarget_run(job, arena, &out, NULL);
    test_memory.left = SIZE_MAX;
    assert_int_equal(out.bone_count, status == TW_OK ? bones : 0);
    assert_int_equal(out.held_count, status == TW_OK ? feet : 0);
    assert_true(status == TW_OK ? failures > 10 : status == TW_NO_MEMORY);
    tw_arena_destroy(arena);
  }
}

TEST(carrying_a_clip_over_survives_every_failure) {
  enum { HEAD = 5 };
  static biped source, target;
  biped_make(&source, (biped_options){.has_twists = true});
  biped_make(&target, (biped_options){.spines = 1, .seed = 2});
  biped_animate(&source, 1, 3);
  tw_retarget_job job = {.source = {source.nodes, source.order, source.count, NULL, NULL},
                         .target = {target.nodes, target.order, target.count, NULL, NULL},
                         .keys = &source.clip,
                         .tolerance = {1e-3, 1e-3},
                         .max_keys = 1000};
  carry_with_failures(&job, target.count, 0);
  const tw_clip_keys nod = {.track_count = 1, .tracks = &source.tracks[source.at[HEAD]]};
  job.keys = &nod; /* meanwhile both feet stand */
  job.holds_feet = true;
  carry_with_failures(&job, target.count, 2);
}

TEST(finding_hard_edges_survives_every_failure) {
  tw_mesh mesh = cube(), out = {0};
  tw_status status = TW_NO_MEMORY;
  for (size_t failures = 0; status != TW_OK; failures++) {
    tw_arena *arena = tw_arena_create();
    test_memory.left = failures;
    status = tw_mesh_with_creases(&mesh, TW_CREASES_AUTO, 0, 1, true, arena, &out, NULL);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_NO_MEMORY ? out.point_count == 0 : out.crease_count == 12);
    assert_true(status == TW_OK ? failures > 3 : status == TW_NO_MEMORY);
    tw_arena_destroy(arena);
  }
}

TEST(gltf_reading_survives_every_failure) {
  struct {
    float positions[6][3], uvs[6][2], times[2], quaternions[2][4];
  } bin = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}},
           {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}},
           {0, 1},
           {{0, 0, 0, 1}, {1, 0, 0, 0}}};
  assert_int_equal(sizeof bin, 160);
  glb_file file = glb_build(
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':160}],'bufferViews':[{'buffer':0,"
      "'byteLength':160}],'accessors':[{'bufferView':0,'componentType':5126,'count':6,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':72,'componentType':5126,'count':6,'type':'VEC2'},"
      "{'bufferView':0,'byteOffset':120,'componentType':5126,'count':2,'type':'SCALAR'},"
      "{'bufferView':0,'byteOffset':128,'componentType':5126,'count':2,'type':'VEC4'},"
      "{'bufferView':0,'componentType':5126,'count':6,'type':'VEC4'}],'materials':[{}],"
      "'meshes':[{'name':'m','primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1,'NORMAL':0,"
      "'TANGENT':4,'_A':1,'COLOR_0':4},'material':0,'targets':[{'POSITION':0,'NORMAL':0}]}]}],"
      "'nodes':[{'mesh':0,'name':'n'}],'skins':[{'joints':[0]}],'animations':[{'samplers':[{'input':2,"
      "'output':3}],'channels':[{'sampler':0,'target':{'node':0,'path':'rotation'}}]}]}",
      &bin, sizeof bin);
  fail_each(read_gltf, file.bytes, file.size);
  free(file.bytes);
}

TEST(compiling_a_clip_survives_every_failure) {
  enum { KEYS = 3000, TRACKS = 3 }; /* large enough for allocations of their own */
  static float times[KEYS], values[KEYS][4];
  tw_track_keys tracks[TRACKS];
  for (uint32_t i = 0; i < KEYS; i++) {
    times[i] = (float)i;
    values[i][i % 4] = 1;
  }
  for (uint32_t i = 0; i < TRACKS; i++) {
    tracks[i] = quaternion_keys(TW_LINEAR, times, values[0], KEYS - i);
    tracks[i].node = i;
  }
  tw_clip_keys keys = {.track_count = TRACKS, .tracks = tracks};
  tw_status status = TW_NO_MEMORY;
  size_t failures = 0;
  for (; status != TW_OK; failures++) {
    tw_clip *clip = NULL;
    test_memory.left = failures;
    status = tw_clip_create(&keys, TRACKS, -1, &clip, NULL);
    test_memory.left = SIZE_MAX;
    if (status != TW_OK) assert_int_equal(status, TW_NO_MEMORY);
    tw_clip_destroy(clip);
  }
  assert_true(failures > 20);
}

TEST(finding_bounds_survives_every_failure) {
  tw_mesh mesh = cube();
  tw_surface_options options = {.level = 5};
  tw_surface *surface = NULL;
  assert_int_equal(tw_surface_create(&mesh, &options, &surface, NULL), TW_OK);
  float min[3], max[3];
  size_t failures = 0;
  for (;; failures++) {
    test_memory.left = failures;
    tw_status status = tw_surface_bounds(surface, -1, min, max);
    test_memory.left = SIZE_MAX;
    if (status == TW_OK) break;
    assert_int_equal(status, TW_NO_MEMORY);
  }
  assert_true(failures > 10);
  tw_surface_destroy(surface);
}

/* Nor do surfaces that share its classes afterwards meet what was left half made. */
static void making_survives(uint32_t level, bool morphs, bool attributes) {
  static const float values[6] = {0, 1, 2, 3, 4, 5};
  static const uint32_t faces[24] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5};
  static const uint32_t parted[24] = {0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5};
  static const tw_attribute of_corners[2] = {
      {.name = "_A", .width = 1, .values = values, .value_count = 6, .corners = parted},
      {.name = "_B",
       .width = 1,
       .values = values,
       .value_count = 6,
       .corners = faces,
       .numbers = TW_NUMBERS_UINT8}};
  static const uint32_t creased_edges[2][2] = {{0, 1}, {1, 2}};
  static const float sharpness[2] = {1.5f, 2.5f};
  tw_mesh mesh = cube();
  mesh.crease_count = 2;
  mesh.crease_edges = creased_edges[0];
  mesh.crease_sharpness = sharpness;
  const float *displacements[2] = {cube_points[0], cube_points[0]};
  if (morphs) {
    mesh.morph_count = 2;
    mesh.morphs = mesh.morph_normals = displacements;
  }
  if (attributes) {
    mesh.attribute_count = 2;
    mesh.attributes = of_corners;
  }
  tw_surface_options options = {.level = level, .normals = true};
  rows wanted = read_rows(&mesh, options);
  size_t failures = 0;
  for (bool failed = true; failed; failures++) {
    options.classes = tw_patch_classes_create();
    assert_non_null(options.classes);
    tw_surface *surface = NULL;
    test_memory.left = failures;
    tw_status status = tw_surface_create(&mesh, &options, &surface, NULL);
    failed = test_memory.left == SIZE_MAX;
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK || status == TW_NO_MEMORY);
    tw_surface_destroy(surface);
    rows next = read_rows(&mesh, options);
    assert_memory_equal(wanted.values, next.values, wanted.count * wanted.layout->stride * sizeof(float));
    free_rows(&next);
    tw_patch_classes_destroy(options.classes);
  }
  assert_true(failures > 30);
  free_rows(&wanted);
}

TEST(making_a_surface_survives_every_failure) {
  making_survives(4, false, false);
}

TEST(making_a_surface_with_values_of_corners_survives_every_failure) {
  making_survives(4, false, true);
  making_survives(2, false, true);
}

TEST(making_what_morph_targets_make_survives_every_failure) {
  making_survives(4, true, false);
}

TEST(modelling_a_level_survives_every_failure) {
  tw_mesh mesh = cube(), deep, both;
  tw_surface_options second = {.level = 2}, first = {.level = 1};
  float points[98 * 3];
  for (int i = 0; i < 98 * 3; i++) points[i] = (float)(i % 7);
  tw_arena *arena = tw_arena_create();
  assert_int_equal(tw_mesh_sculpt(&mesh, &second, points, NULL, NULL, arena, &deep, NULL), TW_OK);
  size_t failures = 0;
  for (bool failed = true; failed; failures++) {
    tw_arena *own = tw_arena_create();
    test_memory.left = failures;
    tw_status status = tw_mesh_sculpt(&deep, &first, points, NULL, NULL, own, &both, NULL);
    failed = test_memory.left == SIZE_MAX;
    test_memory.left = SIZE_MAX;
    assert_int_equal(status, failed ? TW_NO_MEMORY : TW_OK);
    tw_arena_destroy(own);
  }
  assert_true(failures > 100);
  tw_arena_destroy(arena);
}
