/* The page of server/page, embedded in the binary by the build: HTML, compressed with gzip. */
#ifndef SRV_PAGE_H
#define SRV_PAGE_H

#include <stddef.h>

extern const unsigned char srv_page[];
extern const size_t srv_page_size;
extern const char srv_page_hash[];   /* SHA-256 in hex */
extern const char srv_page_policy[]; /* Content-Security-Policy */

#endif
