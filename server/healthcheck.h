/* The daemon as a client of itself: what a container's health check runs. */
#ifndef SRV_HEALTHCHECK_H
#define SRV_HEALTHCHECK_H

#include "listen.h"

/* Whether GET /readyz answers 200 within a few seconds; says why not on standard error. tls: speaks
 * TLS and takes any certificate, for it asks no stranger. */
bool srv_healthcheck(const srv_address *address, bool tls);

#endif
