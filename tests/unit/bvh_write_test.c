/* BVH written: closed-form text, a chain as long as may be, and memory that fails. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "keys.h"
#include "test.h"
#include "tweend/format.h"
#include "wrapped_memory.h"

static tw_model *read_text(const char *text) {
  tw_model *model = NULL;
  tw_error error = {0};
  if (tw_bvh_read((const uint8_t *)text, strlen(text), &model, &error) != TW_OK) fail_msg("%s", error.detail);
  return model;
}

static tw_clip *compile(const tw_model *model) {
  tw_clip *clip = NULL;
  assert_int_equal(tw_clip_create(&model->clips[0], model->node_count, -1, &clip, NULL), TW_OK);
  return clip;
}

/* All text of a stream, in blocks of so many bytes; malloc'ed. */
static char *read_all(tw_bvh_stream *stream, size_t block) {
  size_t size = 0, room = 1 << 20;
  char *text = malloc(room + 1);
  for (;;) {
    if (room - size < block) text = realloc(text, (room *= 2) + 1);
    int64_t count = tw_bvh_stream_read(stream, (uint8_t *)text + size, block);
    assert_true(count >= 0);
    if (count == 0) break;
    size += (size_t)count;
  }
  text[size] = '\0';
  return text;
}

static char *write_text(const tw_bvh_options *options, size_t block) {
  tw_bvh_stream *stream = NULL;
  tw_error error = {0};
  if (tw_bvh_stream_create(options, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  char *text = read_all(stream, block);
  tw_bvh_stream_destroy(stream);
  return text;
}

static const char walk[] =
    "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0 0\n"
    "\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "\tJOINT Knee\n\t{\n\t\tOFFSET 0 -2 0\n\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n"
    "\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 -3 0.5\n\t\t}\n\t}\n}\n"
    "MOTION\nFrames: 3\nFrame Time: 0.5\n"
    "0 1 0 10 -20 30 5 6 7\n1 1 0.25 11 -21 31 0 0 0\n2 1 0.5 12 -22 131 -5 -6 -7\n";

TEST(text_comes_back_as_it_was) {
  tw_model *model = read_text(walk);
  tw_clip *clip = compile(model);
  for (tw_bvh_choice choice = TW_BVH_MOVED; choice <= TW_BVH_ALL; choice++)
    for (size_t block = 1; block <= 1000; block += 999) {
      char *text = write_text(&(tw_bvh_options){.model = model,
                                                .clip = clip,
                                                .choice = choice,
                                                .order = TW_ZXY,
                                                .fps = 2,
                                                .frame_count = 3,
                                                .duration = 1},
                              block);
      assert_string_equal(text, walk);
      free(text);
    }
  tw_clip_destroy(clip);
  tw_model_destroy(model);
}

/* A name in Latin-1 takes two bytes of UTF-8 a letter; twins get a number behind their name. */
TEST(longest_names_are_read_again) {
  enum { LONGEST = TW_NAME_MAX };
  static const char head[] = "HIERARCHY\nROOT a\n{\nCHANNELS 1 Xrotation\nJOINT ",
                    site[] = "\n{\nEnd Site\n{\n}\n}\nJOINT ",
                    tail[] = "\n{\n}\n}\nMOTION\nFrames: 1\nFrame Time: 1\n0\n";
  char text[2 * LONGEST + sizeof head + sizeof site + sizeof tail], *at;
  for (int is_latin1 = 0; is_latin1 < 2; is_latin1++) {
    size_t length = is_latin1 ? LONGEST / 2 : LONGEST;
    at = stpcpy(text, head);
    for (int twin = 0; twin < 2; twin++) {
      memset(at, is_latin1 ? 0xE4 : 'n', length);
      at = stpcpy(at + length, twin ? tail : site);
    }
    tw_model *model = read_text(text);
    assert_int_equal(strlen(model->nodes[1].name), LONGEST);
    assert_null(model->nodes[2].name); /* the end site's would be longer */
    tw_clip *clip = compile(model);
    char *written = write_text(
        &(tw_bvh_options){.model = model, .clip = clip, .choice = TW_BVH_ALL, .fps = 1, .frame_count = 1},
        1000);
    tw_model *back = read_text(written);
    assert_string_equal(back->nodes[1].name, model->nodes[1].name);
    assert_true(strlen(back->nodes[3].name) <= LONGEST);
    tw_model_destroy(back);
    free(written);
    tw_clip_destroy(clip);
    tw_model_destroy(model);
  }
}

TEST(orders_are_those_farthest_from_lock) {
  /* The middle angle of ZXY is that about x, of YZX that about z: the knee is 1 degree from lock in the
   * first. */
  tw_model *model =
      read_text("HIERARCHY\nROOT Hips\n{\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT Knee\n{\n"
                "CHANNELS 3 Zrotation Xrotation Yrotation\n}\n}\nMOTION\nFrames: 2\nFrame Time: 1\n"
                "0 0 0 0 89 0\n0 0 0 0 45 0\n");
  tw_clip *clip = compile(model);
  char *text = write_text(
      &(tw_bvh_options){.model = model, .clip = clip, .order = -1, .fps = 1, .frame_count = 2, .duration = 1},
      4096);
  const char *hips = strstr(text, "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n");
  assert_non_null(hips); /* all orders are as far: its own */
  const char *knee = strstr(hips, "CHANNELS 3 X");
  assert_non_null(knee); /* about x first: the first order that keeps the middle angle at 0 */
  assert_non_null(strstr(knee, "\n0 0 0 0 0 0 89 0 0\n"));
  free(text);
  tw_clip_destroy(clip);
  tw_model_destroy(model);
}

TEST(without_moving_nodes_all_are_written) {
  tw_model *model = read_text("HIERARCHY\nROOT a\n{\nOFFSET 1 2 3\n}\nROOT b\n{\n}\n");
  char *text =
      write_text(&(tw_bvh_options){.model = model, .order = TW_XYZ, .fps = 1, .frame_count = 1}, 4096);
  assert_non_null(strstr(text, "ROOT root\n"));
  assert_non_null(strstr(text, "JOINT a\n\t{\n\t\tOFFSET 1 2 3\n"));
  tw_model *again = read_text(text);
  assert_int_equal(again->node_count, 5); /* with two end sites */
  tw_model_destroy(again);
  free(text);
  tw_model_destroy(model);
}

TEST(without_nodes_there_is_nothing_to_write) {
  tw_model *model = tw_model_create(), *empty = NULL;
  assert_int_equal(tw_model_end(model, TW_OK, &empty, NULL), TW_OK);
  const tw_bvh_options options = {.model = empty, .order = TW_XYZ, .fps = 1, .frame_count = 1};
  tw_bvh_stream *stream = NULL;
  assert_int_equal(tw_bvh_stream_create(&options, &stream, NULL), TW_INVALID);
  assert_null(stream);
  tw_model_destroy(empty);
}

TEST(longest_chain_is_written_in_proportion) {
  enum { JOINTS = TW_NODES_MAX / 2 };
  char *source = malloc(JOINTS * 10 + 100), *at = stpcpy(source, "HIERARCHY\n");
  for (int i = 0; i < JOINTS; i++) at = stpcpy(at, "JOINT{");
  memset(at, '}', JOINTS);
  at[JOINTS] = '\0';
  tw_model *model = read_text(source);
  free(source);
  char *text = write_text(
      &(tw_bvh_options){.model = model, .choice = TW_BVH_ALL, .order = -1, .fps = 1, .frame_count = 2},
      1 << 16);
  assert_true(strlen(text) < (size_t)JOINTS * 400);
  tw_model *again = read_text(text);
  assert_int_equal(again->node_count, JOINTS + 1);
  assert_int_equal(again->clips[0].tracks[0].key_count, 2);
  tw_model_destroy(again);
  free(text);
  tw_model_destroy(model);
}

TEST(writing_survives_every_failure) {
  tw_model *model = read_text(walk);
  tw_clip *clip = compile(model);
  const tw_bvh_options options = {
      .model = model, .clip = clip, .order = -1, .fps = 2, .frame_count = 3, .duration = 1};
  size_t failures = 0;
  for (bool failed = true; failed; failures++) {
    tw_bvh_stream *stream = NULL;
    uint8_t block[4096];
    test_memory.left = failures;
    tw_status status = tw_bvh_stream_create(&options, &stream, NULL);
    int64_t count = status == TW_OK ? tw_bvh_stream_read(stream, block, sizeof block) : 0;
    failed = test_memory.left == SIZE_MAX;
    test_memory.left = SIZE_MAX;
    if (status != TW_OK) assert_int_equal(status, TW_NO_MEMORY);
    assert_true(status != TW_OK || failed == (count < 0));
    tw_bvh_stream_destroy(stream);
  }
  assert_true(failures > 3);
  tw_clip_destroy(clip);
  tw_model_destroy(model);
}
