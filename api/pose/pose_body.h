/* Poses as bytes: a clip is evaluated at one time after the other, and each pose is printed when it is read.
 * Memory does not grow with the number of times. */
#ifndef API_POSE_BODY_H
#define API_POSE_BODY_H

#include "pose_request.h"

/* Numbers that a pose prints, at least 1, as the time is printed even where there are no nodes. */
uint64_t api_pose_numbers(const api_pose_request *request);

typedef struct api_pose_body api_pose_body;

/* Takes over the entries of a resolved request. arena: for scratch in proportion to the model's nodes; the
 * arena and the request's nodes outlive the body. NULL without memory: the request keeps its entries. */
api_pose_body *api_pose_body_create(api_pose_request *request, api_service *service, tw_arena *arena);
void api_pose_body_destroy(void *context); /* as in api_body; NULL accepted */

/* Bytes of the whole answer in the binary form, else API_SIZE_UNKNOWN. */
uint64_t api_pose_body_size(const api_pose_body *body);

/* As in api_body. */
int64_t api_pose_body_read(void *context, uint8_t *out, size_t capacity);

/* Prints the whole answer into an empty text; replaces reading it. */
void api_pose_body_print_all(api_pose_body *body, tw_text *text);

/* Prints the pose at one time in the request's form, which must have lines of text; ignores the request's
 * times. Euler angles continue from the pose printed before. */
void api_pose_body_print_at(api_pose_body *body, double time, tw_text *text);

#endif
