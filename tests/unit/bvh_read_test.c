/* BVH: bad input with its line, every notation that files are met in, and the rotations against products of
 * plain matrices. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host.h"
#include "test.h"
#include "tweend/format.h"

static const double DEGREE = 3.141592653589793 / 180;

static tw_model *read_text(const char *text) {
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(tw_format_sniff((const uint8_t *)text, strlen(text)), TW_FORMAT_BVH);
  tw_status status = tw_bvh_read((const uint8_t *)text, strlen(text), &model, &error);
  assert_string_equal(status == TW_OK ? "" : error.detail, "");
  return model;
}

static void assert_refused(const char *text, tw_status status, uint64_t line) {
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(tw_bvh_read((const uint8_t *)text, strlen(text), &model, &error), status);
  assert_int_equal(error.line, line);
  assert_true(strlen(error.detail) > 10);
  assert_null(model);
}

#define ROOT "HIERARCHY\nROOT Hips\n{\nOFFSET 1 2 3\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n"
#define HEAD ROOT "MOTION\nFrames: 2\nFrame Time: 0.5\n"

TEST(what_is_out_of_place_is_refused_with_its_line) {
  assert_refused("o cube\n", TW_SYNTAX, 1);
  assert_refused("HIERARCHY", TW_SYNTAX, 1);
  assert_refused("HIERARCHY\nMOTION\n", TW_SYNTAX, 2);
  assert_refused("HIERARCHY\nOFFSET 0 0 0\n", TW_SYNTAX, 2);
  assert_refused("HIERARCHY\nCHANNELS 1 Xrotation\n", TW_SYNTAX, 2);
  assert_refused("HIERARCHY\n}\n", TW_SYNTAX, 2);
  assert_refused("HIERARCHY\nEnd Site\n{\n}\n", TW_SYNTAX, 2);
  assert_refused("HIERARCHY\nROOT a\n{\nEnd\n{\n}\n}\n", TW_SYNTAX, 5);
  assert_refused("HIERARCHY\nROOT a\n{\nEnd Site\n{\nJOINT b\n{\n}\n}\n}\n", TW_SYNTAX, 6);
  assert_refused("HIERARCHY\nROOT a\n{\nEnd Site\n{\nCHANNELS 1 Xrotation\n}\n}\n", TW_SYNTAX, 6);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 1 Xrotation\nYrotation\n}\n", TW_SYNTAX, 5);
  assert_refused("HIERARCHY\nROOT a\n{\nEnd Site\n{\nCHANNELS 0 CHANNELS 0\n}\n}\n", TW_SYNTAX, 6);
  assert_refused("HIERARCHY\nROOT a\nOFFSET 0 0 0\n", TW_SYNTAX, 2);
  assert_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0\n}\n", TW_SYNTAX, 5);
  assert_refused("HIERARCHY\nROOT a\n{\nwhat 0 0\n}\n", TW_SYNTAX, 4);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 2 Xrotation\n}\n", TW_SYNTAX, 5);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 1 Wrotation\n}\n", TW_SYNTAX, 4);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS -1\n}\n", TW_SYNTAX, 4);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 0\nCHANNELS 0\n}\n", TW_SYNTAX, 5);
  assert_refused("HIERARCHY\nROOT a\n{\nJOINT b\n{\n}\nCHANNELS 1 Xrotation\n}\n", TW_SYNTAX, 7);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 2 Xposition Xposition\n}\n", TW_INVALID, 4);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 3 Xrotation Yrotation Xrotation\n}\n", TW_UNSUPPORTED, 4);
  assert_refused("HIERARCHY\nROOT a\n{\nMOTION\n", TW_SYNTAX, 4);
}

TEST(broken_heads_and_numbers_are_refused_with_their_line) {
  assert_refused(ROOT "MOTION\n1 2 3\n", TW_SYNTAX, 8);
  assert_refused(ROOT "MOTION\nFrames: 1\n1 2 3\n", TW_SYNTAX, 9);
  assert_refused(ROOT "MOTION\nFrames:\n2\nFrame Time: 1\n1 2 3\n", TW_SYNTAX, 8);
  assert_refused(ROOT "MOTION\nFrames: 2\nFrame Time: \r\n1 2 3\n4 5 6\n", TW_SYNTAX, 9);
  assert_refused(ROOT "MOTION\nFrames: 2\nFrame Time:", TW_SYNTAX, 9);
  assert_refused(ROOT "MOTION\nFrames: one\n", TW_SYNTAX, 8);
  assert_refused(ROOT "MOTION\nFrames: 1.5\n", TW_SYNTAX, 8);
  assert_refused(ROOT "MOTION\nFrames: -1\n", TW_SYNTAX, 8);
  assert_refused(ROOT "MOTION\nFrames: 1\nFrame Time: -0.1\n1 2 3\n", TW_INVALID, 9);
  assert_refused(ROOT "MOTION\nFrames: 1\nFrame Time: inf\n1 2 3\n", TW_INVALID, 9);
  assert_refused(ROOT "MOTION\nFrames: 1\nFrame Time: 1e38\n1 2 3\n", TW_INVALID, 9);
  assert_refused(ROOT "MOTION\nFrames: 2\nFrame Time: 0\n1 2 3\n4 5 6\n", TW_INVALID, 10);
  assert_refused(HEAD "1 2 3\n4 5x 6\n", TW_SYNTAX, 11);
  assert_refused(HEAD "1 2 3\n4 {5 6\n", TW_SYNTAX, 11);
  assert_refused(HEAD "1 2 3\n4 nan 6\n", TW_INVALID, 11);
  assert_refused(HEAD "1 2 3\n4 1e999 6\n", TW_INVALID, 11);
  assert_refused(HEAD "1 2 3\n\r\n4 -2e9 6\n", TW_INVALID, 12);
  assert_refused(HEAD "1 2 3\n4 5 6\n7 x\n", TW_SYNTAX, 12); /* in a frame that is left out, too */
  assert_refused(HEAD "1 2 3\n4 5\n6 7 8\n9 10 11\n", TW_SYNTAX, 12);
  assert_refused(HEAD "1 2 3 4\n5 6 7\n8 9\n", TW_SYNTAX, 10);
  assert_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 1e39 0\n}\n", TW_INVALID, 4);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 1 Xposition\n}\nMOTION\nFrames: 1\nFrame Time: 1\n1e39\n",
                 TW_INVALID, 9);
  assert_refused("HIERARCHY\nROOT a\n{\n}\nMOTION\nFrames: 1\nFrame Time: 1\n1\n", TW_SYNTAX, 8);
}

/* Reads `text` with a part of `count` bytes repeated at its end. */
static void assert_long_is_refused(const char *text, const char *part, size_t count, tw_status status) {
  size_t length = strlen(text), each = strlen(part), repeats = count / each;
  char *all = malloc(length + repeats * each + 1);
  memcpy(all, text, length);
  for (size_t i = 0; i < repeats; i++) memcpy(all + length + i * each, part, each);
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(tw_bvh_read((const uint8_t *)all, length + repeats * each, &model, &error), status);
  assert_true(strlen(error.detail) > 10 && error.line > 0);
  assert_null(model);
  free(all);
}

#define LATIN_60  LATIN_6 LATIN_6 LATIN_6 LATIN_6 LATIN_6 LATIN_6 LATIN_6 LATIN_6 LATIN_6 LATIN_6
#define LATIN_6   "\xE4\xE4\xE4\xE4\xE4\xE4"
#define LATIN_600 LATIN_60 LATIN_60 LATIN_60 LATIN_60 LATIN_60 LATIN_60 LATIN_60 LATIN_60 LATIN_60 LATIN_60

TEST(hostile_files_end_with_an_error) {
  assert_long_is_refused("HIERARCHY ", "JOINT a\n{", 9000000, TW_LIMIT); /* a million joints in a chain */
  assert_long_is_refused(HEAD "1 2 ", "1", 1 << 20, TW_SYNTAX);
  assert_long_is_refused(HEAD "1 2 0.", "0", 1 << 20, TW_SYNTAX);
  assert_long_is_refused("HIERARCHY\nROOT ", "n", 1 << 20, TW_INVALID);
  assert_refused("HIERARCHY\nROOT " LATIN_600
                 "\n{\nCHANNELS 1 Xrotation\n}\nMOTION\nFrames: 1\nFrame Time: 1\n0\n",
                 TW_INVALID, 0);
  assert_long_is_refused("HIERARCHY\nROOT a {", "CHANNELS 1 Xrotation ", 1 << 20, TW_SYNTAX);
  assert_long_is_refused("HIERARCHY\nROOT a { CHANNELS 1 Xrotation } MOTION Frames: 9 Frame Time: 1\n", "0\n",
                         17 << 20, TW_LIMIT);
  assert_refused(ROOT "MOTION\nFrames: 1e9\nFrame Time: 0.5\n1 2 3\n", TW_INVALID, 10);
  assert_refused("HIERARCHY\nROOT a\n{\nCHANNELS 4e9 Xrotation\n}\n", TW_SYNTAX, 5);
}

/* One rotation channel a joint takes 24 bytes of keys for 2 of text. */
TEST(keys_that_outgrow_their_file_are_refused) {
  static const char joint[] = "JOINT{CHANNELS 1 Xrotation ";
  enum { JOINTS = 1000, FRAMES = 8000 };
  char *text = malloc(JOINTS * sizeof joint + JOINTS + (size_t)FRAMES * (2 * JOINTS) + 200), *at = text;
  at = stpcpy(at, "HIERARCHY\n");
  for (int i = 0; i < JOINTS; i++) at = stpcpy(at, joint);
  for (int i = 0; i < JOINTS; i++) *at++ = '}';
  at += sprintf(at, "MOTION Frames: %d Frame Time: 1\n", FRAMES);
  for (int f = 0; f < FRAMES; f++) {
    for (int i = 0; i < JOINTS; i++) at = stpcpy(at, "0 ");
    at[-1] = '\n';
  }
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(tw_bvh_read((const uint8_t *)text, (size_t)(at - text), &model, &error), TW_LIMIT);
  assert_null(model);
  free(text);
}

static const tw_track_keys *track_of(const tw_model *model, const char *node, tw_path path) {
  for (uint32_t i = 0; i < model->clips[0].track_count; i++) {
    const tw_track_keys *track = &model->clips[0].tracks[i];
    if (track->path == path && strcmp(model->nodes[track->node].name, node) == 0) return track;
  }
  fail_msg("%s has no such track", node);
  return NULL;
}

static void assert_angles(const tw_track_keys *track, uint32_t key, double x, double y, double z) {
  const double wanted[3] = {x, y, z};
  for (int i = 0; i < 3; i++)
    assert_true(fabs(track->angles[3 * key + (uint32_t)i] / DEGREE - wanted[i]) < 1e-12);
}

static void assert_position(const tw_track_keys *track, uint32_t key, double x, double y, double z) {
  const double wanted[3] = {x, y, z};
  for (int i = 0; i < 3; i++) assert_true((double)track->values[3 * key + (uint32_t)i] == wanted[i]);
}

TEST(joints_become_nodes_and_channels_tracks) {
  tw_model *model =
      read_text("HIERARCHY\nROOT Hips\n{\n\tOFFSET 1 2 3\n"
                "\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
                "\tJOINT Leg\n\t{\n\t\tOFFSET 0 -4 0.5\n\t\tCHANNELS 3 Xrotation Yrotation Zrotation\n"
                "\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 -5 0\n\t\t}\n\t}\n}\nMOTION\nFrames: 2\n"
                "Frame Time: 0.25\n10 20 30 40 50 60 70 80 90\n-1 -2 -3 -4 -5 -6 -7 -8 -9\n");
  assert_int_equal(model->format, TW_FORMAT_BVH);
  assert_int_equal(model->node_count, 3);
  assert_int_equal(model->warning_count, 0);
  static const char *const names[] = {"Hips", "Leg", "Leg_end"};
  static const uint32_t parents[] = {TW_NO_INDEX, 0, 1};
  static const float offsets[][3] = {{1, 2, 3}, {0, -4, 0.5f}, {0, -5, 0}};
  for (uint32_t i = 0; i < 3; i++) {
    assert_string_equal(model->nodes[i].name, names[i]);
    assert_int_equal(model->nodes[i].parent, parents[i]);
    assert_memory_equal(model->nodes[i].rest.translation, offsets[i], sizeof offsets[i]);
    assert_true(model->nodes[i].rest.rotation[3] == 1);
  }
  assert_int_equal(model->clip_count, 1);
  assert_string_equal(model->clips[0].name, "motion");
  assert_int_equal(model->clips[0].track_count, 3);
  const tw_track_keys *moved = track_of(model, "Hips", TW_TRANSLATION),
                      *turned = track_of(model, "Hips", TW_ROTATION);
  assert_int_equal(moved->key_count, 2);
  assert_true(moved->times[0] == 0 && moved->times[1] == 0.25f);
  assert_ptr_equal(moved->times, turned->times);
  assert_position(moved, 0, 10, 20, 30);
  assert_int_equal(turned->interpolation, TW_EULER);
  assert_int_equal(turned->order, TW_ZXY);
  assert_angles(turned, 0, 50, 60, 40);
  assert_int_equal(track_of(model, "Leg", TW_ROTATION)->order, TW_XYZ);
  assert_angles(track_of(model, "Leg", TW_ROTATION), 1, -7, -8, -9);
  tw_model_destroy(model);
}

TEST(each_joint_has_its_own_order_of_any_number_of_channels) {
  static const char *const orders[TW_EULER_ORDERS] = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"};
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    char text[600];
    const char *o = orders[order];
    snprintf(text, sizeof text,
             "HIERARCHY\nROOT a\n{\nCHANNELS 3 %crotation %crotation %crotation\nJOINT b\n{\nOFFSET 1 2 3\n"
             "CHANNELS 3 Yposition %crotation Xposition\nJOINT c\n{\nOFFSET 0 0 0\nCHANNELS 4 %crotation "
             "%crotation "
             "Zposition Xscale\n"
             "}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 1\n1 2 3 4 5 6 7 8 9 10\n",
             o[0], o[1], o[2], o[0], o[0], o[1]);
    tw_model *model = read_text(text);
    double wanted[3] = {0}, first[3] = {0}, two[3] = {0};
    for (int i = 0; i < 3; i++) wanted[o[i] - 'X'] = i + 1;
    first[o[0] - 'X'] = 5;
    two[o[0] - 'X'] = 7;
    two[o[1] - 'X'] = 8;
    assert_int_equal(track_of(model, "a", TW_ROTATION)->order, order);
    assert_angles(track_of(model, "a", TW_ROTATION), 0, wanted[0], wanted[1], wanted[2]);
    assert_angles(track_of(model, "b", TW_ROTATION), 0, first[0], first[1], first[2]);
    assert_position(track_of(model, "b", TW_TRANSLATION), 0, 6, 4, 3); /* z stays at the offset */
    assert_int_equal(track_of(model, "c", TW_ROTATION)->order, order);
    assert_angles(track_of(model, "c", TW_ROTATION), 0, two[0], two[1], two[2]);
    assert_int_equal(model->warning_count, 1); /* the scale */
    assert_non_null(strstr(model->warnings[0], "scale"));
    tw_model_destroy(model);
  }
}

TEST(notations_of_real_files_read_alike) {
  static const char *const texts[] = {
      "HIERARCHY\nROOT Hips\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Yrotation Xrotation\nEnd Site\n{\nOFFSET "
      "0 2 0\n}\n}\n"
      "MOTION\nFrames: 2\nFrame Time: 0.5\n1 2 3\n4 5 6.5\n",
      "\xEF\xBB\xBF\r\n HIERARCHY \r\n\r\nROOT Hips \t\r\n{ \r\n\tOFFSET\t0\t1\t0 \r\n\t CHANNELS 3 "
      "Zrotation\tYrotation "
      "Xrotation \r\n\tEnd Site \r\n\t{\r\n\t\tOFFSET 0.0 2.0e0 -0\r\n\t}\r\n}\r\n\r\nMOTION "
      "\r\n\r\nFrames:\t2 \r\nFrame "
      "Time:\t.5\r\n\r\n1\t2\t 3 \r\n \r\n 4 5 6.5 \r\n\r\n\x1A",
      "HIERARCHY\rROOT Hips {\rOFFSET 0 +1 0\rCHANNELS 3 Zrotation Yrotation Xrotation\rEnd Site {\rOFFSET 0 "
      "2 0 } }\r"
      "MOTION\rFrames: 2\rFrame Time: 5E-1\r1 2 3\r4 5 65e-1",
      "hierarchy root Hips { offset 0 1 0 channels 3 zrotation YROTATION XRotation END SITE { OFFSET 0 2 0 } "
      "} motion\n"
      "FRAMES : 2\nFRAME TIME : 0,5\n1,0 2 3\n4\n5 6,5",
      "HIERARCHY\nJOINT Hips{CHANNELS 3 Zrotation Yrotation Xrotation OFFSET 0 1 0 End Site{OFFSET 0 2 "
      "0}}MOTION\n"
      "FrameTime: 0.5\nFrames:2\n1 2 3\n4 5 6.5\n",
      "HIERARCHY\nROOT Hips{CHANNELS 3 Zrotation Yrotation Xrotation OFFSET 0, 1, 0 End Site{OFFSET 0, 2, "
      "0}}MOTION\n"
      "Frames: 2\nFrame Time: 0.5\n1, 2, 3\n4, 5, 6.5\n",
      "HIERARCHY\nROOT Hips{OFFSET 0 1 0 CHANNELS 3 Zrotation Yrotation Xrotation End Site{OFFSET 0 2 0 "
      "CHANNELS 0}}MOTION\n"
      "Frames: 2\nFrame Time: 0.5\n1 2 3\n4 5 6.5\n",
  };
  for (size_t t = 0; t < sizeof texts / sizeof *texts; t++) {
    tw_model *model = read_text(texts[t]);
    assert_int_equal(model->node_count, 2);
    assert_string_equal(model->nodes[0].name, "Hips");
    assert_string_equal(model->nodes[1].name, "Hips_end");
    assert_true(model->nodes[0].rest.translation[1] == 1 && model->nodes[1].rest.translation[1] == 2);
    assert_int_equal(model->warning_count, t == 3);
    if (t == 3)
      assert_string_equal(model->warnings[0],
                          "3 numbers have a comma, the first in line 3: it is read as the decimal point");
    const tw_track_keys *track = track_of(model, "Hips", TW_ROTATION);
    assert_int_equal(track->order, TW_ZYX);
    assert_int_equal(track->key_count, 2);
    assert_true(track->times[1] == 0.5f);
    assert_angles(track, 0, 3, 2, 1);
    assert_angles(track, 1, 6.5, 5, 4);
    tw_model_destroy(model);
  }
}

TEST(names_hold_blanks_and_keywords) {
  tw_model *model = read_text(
      "HIERARCHY\nROOT Left Arm \n{\nJOINT LeftHandEnd\n{\nEnd Site the tip\n{\n}\nEnd Site\n{\n}\n}\n"
      "JOINT End Site\n{\n}\nJOINT JOINT\n{\n}\nJOINT\n{\nEnd Site\n{\n}\n}\nJOINT h\xE4nd\n{\n}\n}\n");
  static const char *const names[] = {"Left Arm", "LeftHandEnd", "LeftHandEnd_end", NULL, "End Site", "JOINT",
                                      NULL,       NULL,          "h\xC3\xA4nd"};
  assert_int_equal(model->node_count, 9);
  for (uint32_t i = 0; i < 9; i++) {
    if (names[i])
      assert_string_equal(model->nodes[i].name, names[i]);
    else
      assert_null(model->nodes[i].name);
  }
  assert_int_equal(model->nodes[3].parent, 1);
  assert_int_equal(model->nodes[7].parent, 6);
  assert_int_equal(model->clip_count, 0);
  assert_int_equal(model->warning_count, 4);
  assert_string_equal(model->warnings[0], "there is no MOTION, and so no clip");
  assert_string_equal(model->warnings[1],
                      "1 name of an end site is left out, in line 6: it is named after its joint");
  assert_string_equal(model->warnings[2], "1 name is not UTF-8: it is read as Latin-1");
  assert_string_equal(model->warnings[3], "8 joints have no OFFSET: they are where their parents are");
  tw_model_destroy(model);
}

TEST(the_last_of_several_offsets_counts_and_they_are_told) {
  tw_model *model =
      read_text("HIERARCHY\nROOT a\n{\nOFFSET 1 2 3\nOFFSET 4 5 6\nJOINT b\n{\nOFFSET 7 8 9\n}\n"
                "OFFSET 0 1 0\n}\nMOTION\nFrames: 0\nFrame Time: 1\n");
  assert_true(model->nodes[0].rest.translation[0] == 0 && model->nodes[0].rest.translation[1] == 1);
  assert_true(model->nodes[1].rest.translation[0] == 7);
  assert_int_equal(model->warning_count, 2);
  assert_string_equal(model->warnings[0], "MOTION has no frame, and so there is no clip");
  assert_string_equal(model->warnings[1],
                      "2 OFFSETs take the place of others before them in their joints, the first in line 5");
  tw_model_destroy(model);
}

TEST(another_number_of_frames_is_a_warning) {
  static const struct {
    const char *rows;
    uint32_t keys, warnings;
  } cases[] = {{"1 2 3\n4 5 6\n", 2, 0},
               {"1 2 3\n", 1, 1},
               {"1 2 3\n4 5 6\n7 8 9\n", 3, 1},
               {"", 0, 1},
               {"1 2", 0, 2},
               {"1 2 3\n4 5", 1, 2},
               {"1 2 3\n4 5 6\n7", 2, 1}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[400];
    snprintf(text, sizeof text, HEAD "%s", cases[i].rows);
    tw_model *model = read_text(text);
    assert_int_equal(model->clip_count, cases[i].keys > 0);
    if (cases[i].keys) assert_int_equal(track_of(model, "Hips", TW_ROTATION)->key_count, cases[i].keys);
    assert_int_equal(model->warning_count, cases[i].warnings);
    if (i == 1) assert_string_equal(model->warnings[0], "Frames: says 2, and there is 1");
    tw_model_destroy(model);
  }
}

TEST(single_frame_needs_no_frame_time) {
  tw_model *model = read_text(ROOT "MOTION\nFrames: 1\nFrame Time: 0\n1 2 3\n");
  assert_int_equal(track_of(model, "Hips", TW_ROTATION)->key_count, 1);
  tw_model_destroy(model);
}

TEST(steps_over_180_degrees_are_told) {
  tw_model *model = read_text(HEAD "179 0 0\n-179 0 0\n");
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "180 degrees or more"));
  tw_model_destroy(model);
}

/* m = m * the rotation about an axis. */
static void turn(double m[3][3], int axis, double angle) {
  int j = (axis + 1) % 3, k = (axis + 2) % 3;
  for (int row = 0; row < 3; row++) {
    double a = m[row][j], b = m[row][k];
    m[row][j] = a * cos(angle) + b * sin(angle);
    m[row][k] = b * cos(angle) - a * sin(angle);
  }
}

TEST(rotations_are_the_products_of_channels) {
  static const char channels[3][4] = {"ZXY", "YZX", "XYZ"};
  for (int c = 0; c < 3; c++) {
    char text[400];
    const char *o = channels[c];
    snprintf(text, sizeof text,
             "HIERARCHY\nROOT a\n{\nCHANNELS 3 %crotation %crotation %crotation\n}\nMOTION\nFrames: 1\nFrame "
             "Time: 1\n"
             "31.5 -72.25 143\n",
             o[0], o[1], o[2]);
    tw_model *model = read_text(text);
    tw_clip *clip = NULL;
    assert_int_equal(tw_clip_create(&model->clips[0], model->node_count, -1, &clip, NULL), TW_OK);
    tw_trs pose;
    float found[16];
    tw_clip_pose(clip, model->nodes, 1, 0, &pose);
    tw_trs_to_matrix(&pose, found);
    double wanted[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    turn(wanted, o[0] - 'X', 31.5 * DEGREE);
    turn(wanted, o[1] - 'X', -72.25 * DEGREE);
    turn(wanted, o[2] - 'X', 143 * DEGREE);
    for (int row = 0; row < 3; row++)
      for (int column = 0; column < 3; column++)
        assert_true(fabs((double)found[4 * column + row] - wanted[row][column]) < 5e-7);
    tw_clip_destroy(clip);
    tw_model_destroy(model);
  }
}

/* The text of so many frames of three numbers. */
static char *long_motion(uint32_t frames) {
  char *text = malloc(sizeof HEAD + 30 * (size_t)frames), *at = stpcpy(text, HEAD);
  for (uint32_t f = 0; f < frames; f++)
    at += sprintf(at, "%.4f %.4f %.4f\n", 0.001 * f, 100.0 - 0.001 * f, 0.5 * (f % 100));
  return text;
}

TEST(reading_takes_the_memory_of_the_keys) {
  enum { FRAMES = 200000, KEYS = FRAMES * (3 * sizeof(double) + sizeof(float)) };
  char *text = long_motion(FRAMES);
  tw_meter meter;
  tw_meter_init(&meter, &(tw_meter_host){0}, 1 << 30);
  tw_meter *before = tw_meter_use(&meter);
  tw_model *model = read_text(text);
  tw_meter_use(before);
  assert_int_equal(track_of(model, "Hips", TW_ROTATION)->key_count, FRAMES);
  assert_true(meter.peak >= KEYS && meter.peak <= KEYS + (1 << 20));
  tw_model_destroy(model);
  free(text);
}

TEST(reading_stops_when_it_is_no_longer_wanted) {
  char *text = long_motion(100000);
  uint32_t questions = 3; /* the allocations and the count of the frames ask once */
  tw_meter meter;
  tw_meter_init(&meter, &(tw_meter_host){.owner = &questions, .is_over = wants_no_more}, 1 << 30);
  tw_meter *before = tw_meter_use(&meter);
  tw_model *model = NULL;
  tw_status status = tw_bvh_read((const uint8_t *)text, strlen(text), &model, NULL);
  tw_meter_use(before);
  assert_int_equal(status, TW_CANCELLED);
  assert_null(model);
  free(text);
}
