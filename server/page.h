/* What is built of server/page, embedded in the binary. */
#ifndef SRV_PAGE_H
#define SRV_PAGE_H

#include "api.h"

extern const api_page srv_page, srv_docs, srv_example, srv_viewer;

#endif
