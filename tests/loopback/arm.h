/* A small model with a clip, for tests of what clips do. */
#ifndef ARM_H
#define ARM_H

#include "loopback.h"

#include <math.h>

/* Two nodes, one turning by 90 degrees about z in a second and moving by (0, 0, 2). */
static const char arm[] =
    "{'nodes':[{'name':'base'},{'name':'arm','parent':'base','translation':[1,0,0]},{'name':'a,b'},{}],"
    "'clips':[{'name':'turn','tracks':[{'node':'base','path':'rotation','times':[0,1],"
    "'unit':'degrees','axis_angles':[[0,0,1,0],[0,0,1,90]]},{'node':'base','path':'translation',"
    "'times':[0,1],'values':[[0,0,0],[0,0,2]]}]},{'tracks':[]}]}";

/* Stores it. */
static inline int setup(void **state) {
  api_settings settings = loopback_settings();
  settings.limits.max_times = 100000;
  *state = one_model_start(&settings, arm);
  return 0;
}

static inline reply ask(const one_model *f, const char *rest) {
  return model_get(f->loop, f->id, rest);
}

static inline cJSON *ask_json(const one_model *f, const char *rest) {
  return model_get_json(f->loop, f->id, rest);
}

static inline const cJSON *pose(const cJSON *answer, int index) {
  return cJSON_GetArrayItem(json_member(answer, "poses"), index);
}

/* Row `node` of a part equals the numbers, to single precision. */
static inline void assert_row(const cJSON *pose, const char *part, int node, size_t count,
                              const double *expected) {
  const cJSON *row = cJSON_GetArrayItem(json_member(pose, part), node);
  assert_int_equal(cJSON_GetArraySize(row), count);
  for (size_t i = 0; i < count; i++) {
    double value = cJSON_GetArrayItem(row, (int)i)->valuedouble;
    if (fabs(value - expected[i]) > 1e-6) fail_msg("%s[%zu] is %g, expected %g", part, i, value, expected[i]);
  }
}

#endif
