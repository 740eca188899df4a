/* Requests on their way in: what the library calls, on the thread of a connection. */
#ifndef SRV_INTAKE_H
#define SRV_INTAKE_H

#include <microhttpd.h>

typedef struct srv_connection srv_connection;
typedef struct srv_loop srv_loop;

/* With the untouched target, before the library looks for arguments in it. Returns the connection, or NULL
 * without memory. */
void *srv_intake_begin(void *context, const char *target, struct MHD_Connection *mhd);

/* With the headers, then with pieces of the body, then once more. */
enum MHD_Result srv_intake_take(void *context, struct MHD_Connection *mhd, const char *url,
                                const char *method, const char *version, const char *data, size_t *size,
                                void **request);

/* With the answer sent, or the connection lost. */
void srv_intake_end(void *context, struct MHD_Connection *mhd, void **request,
                    enum MHD_RequestTerminationCode how);

/* Where the library logs: it is about to refuse the head of one of the loop's connections, perhaps. */
void srv_intake_complaint(srv_loop *loop);

/* Answers beside the library, which cannot answer before a request has come to its end. Over TLS the
 * connection ends without an answer. */
void srv_intake_refuse(srv_connection *connection);

#endif
