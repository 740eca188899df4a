/* --healthcheck: asks the running daemon whether it is ready, for the health check of a container. */
#ifndef SRV_HEALTHCHECK_H
#define SRV_HEALTHCHECK_H

#include "listen.h"

/* Whether GET /readyz answers 200 within a few seconds; prints the reason to standard error when not. tls:
 * uses TLS and accepts any certificate, since the address is the daemon's own. */
bool srv_healthcheck(const srv_address *address, bool tls);

#endif
