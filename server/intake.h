/* Requests on their way in: what the library calls, on the thread of a connection. */
#ifndef SRV_INTAKE_H
#define SRV_INTAKE_H

#include <microhttpd.h>

typedef struct srv_connection srv_connection;

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

/* Writes the exchange's answer past the library, which cannot answer in the middle of a request, and lets the
 * client read it: what still arrives is thrown away for a while. */
enum MHD_Result srv_intake_refuse(srv_connection *connection);

#endif
