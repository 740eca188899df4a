/* A service that holds the samples cube.obj and tank.json: a fixture of tests of surfaces. */
#ifndef CUBE_AND_TANK_H
#define CUBE_AND_TANK_H

#include "loopback.h"

#include <stdlib.h>

typedef struct fixture {
  loopback *loop;
  char cube[API_ID_TEXT], tank[API_ID_TEXT];
} fixture;

static inline fixture *start(const api_settings *settings) {
  fixture *f = calloc(1, sizeof *f);
  f->loop = loopback_start(settings);
  loopback_upload_sample(f->loop, "model/obj", "cube.obj", f->cube);
  loopback_upload_sample(f->loop, "application/json", "tank.json", f->tank);
  return f;
}

static inline int setup(void **state) {
  api_settings settings = loopback_settings();
  *state = start(&settings);
  return 0;
}

/* An open sheet that a clip moves. */
static const char turning_sheet[] =
    "{\"meshes\":[{\"name\":\"m\",\"shape\":{\"kind\":\"grid\",\"size\":[2,2],\"segments\":[2,2]}}],"
    "\"nodes\":[{\"name\":\"n\",\"mesh\":\"m\"}],\"clips\":[{\"name\":\"c\",\"tracks\":[{\"node\":\"n\","
    "\"path\":\"translation\",\"times\":[0,1],\"values\":[[0,0,0],[1,0,0]]}]}]}";

#endif
