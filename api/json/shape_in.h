/* Reads shapes in tweend JSON. */
#ifndef API_SHAPE_IN_H
#define API_SHAPE_IN_H

#include "json_value.h"
#include "tweend/shape.h"

/* Reads a shape and checks its parameters. The value must not be absent. */
tw_status api_shape_in(const api_value *value, tw_shape *out, tw_shape_counts *counts);

#endif
