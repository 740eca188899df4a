/* Responses of the HTTP library that are used again. Making one, field by field, costs the library more than
 * most of the answers cost that they carry; and most answers of one size differ from those before them in few
 * fields, whose values are as long as before. Each I/O thread has a table of its own. */
#ifndef SRV_REPLY_H
#define SRV_REPLY_H

#include "api.h"

struct MHD_Response;
typedef struct srv_replies srv_replies;
typedef struct srv_reply srv_reply;

/* Whether the library sends what is written over its copy of a field's value, ends of lines too. It may be
 * relied on for as long as the program runs, but the library does not promise it. */
bool srv_rewrites(void);

/* rewrites: values may be written over; else nothing is taken. NULL without memory. */
srv_replies *srv_replies_create(bool rewrites);
void srv_replies_destroy(srv_replies *replies); /* NULL accepted; none is being sent */

/* A reply with these bytes and fields, all copied. Every call has the same name in the first field, which is
 * none that says how the answer is framed. The reply stays as it is until it is given back. NULL when there
 * are no bytes or too many, too many or unfit ones of fields, when as many replies as can be are being sent,
 * or without memory. */
srv_reply *srv_replies_take(srv_replies *replies, const api_header *fields, size_t field_count,
                            api_bytes bytes);

/* Where the bytes may be put that are taken next: there they need not be copied. None when no reply could be
 * taken. */
api_room srv_replies_room(srv_replies *replies);

/* What to queue. Not the caller's to destroy. */
struct MHD_Response *srv_reply_response(const srv_reply *reply);

void srv_reply_give_back(srv_reply *reply); /* NULL accepted */

#endif
