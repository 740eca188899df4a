# HTTP itself: methods, headers, negotiation, framing, operations.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() {
  cd "$BATS_TEST_TMPDIR" || return
  upload "$samples/cube.obj"
  cube=/v1/models/$id
}

# raw BYTES: sends them as they are (printf escapes), leaves what came back in the file answer, status in $status.
# A server that refuses may close before it has read them all.
raw() {
  local host port
  IFS=: read -r host port <<<"${url#http://}"
  printf '%b' "$1" >request
  exec 9<>"/dev/tcp/$host/$port"
  cat request >&9 || true
  timeout 5 cat <&9 >answer || true
  exec 9>&-
  status=$(sed -n '1s/^HTTP\/1.1 \([0-9]*\).*/\1/p' answer)
}

# alone: there was one answer on the connection, and it was closed.
alone() { [ "$(grep -ac '^HTTP/1.1 ' answer)" = 1 ]; }

# ---- operations ----------------------------------------------------------------------------------

@test "healthz, readyz and version" {
  for path in /healthz /readyz /version; do
    get "$path"
    expect 200
    http HEAD "$path"
    expect 200
  done
  get /version
  holds '.version | test("^[0-9]+\\.[0-9]+\\.[0-9]+")'
}

@test "metrics count the requests by route" {
  get "$cube"
  get /metrics
  expect 200
  [[ $(header content-type) == text/plain* ]]
  grep -qE '^tweend_[a-z_]+(\{.*\})? [0-9]' answer
  grep -F '/v1/models/{id}' answer
  if grep -F "$id" answer; then false; fi
}

@test "openapi.json describes every path that answers" {
  get /openapi.json
  expect 200
  [[ $(header content-type) == application/*json* ]]
  holds '.openapi | startswith("3.1")'
  for path in /v1/models '/v1/models/{id}' '/v1/models/{id}/source' '/v1/models/{id}/surface' \
    '/v1/models/{id}/pose' /v1/surface /v1/pose /healthz /readyz /version /openapi.json; do
    holds "[.paths | keys[] | sub(\"\\\\{[^}]*\\\\}\"; \"{id}\"; \"g\")] | any(startswith(\"$path\"))"
  done
}

# ---- methods -------------------------------------------------------------------------------------

@test "HEAD answers as GET does, without the body" {
  for path in /v1/models "$cube" "$cube/source" "$cube/surface.glb" "$cube/surface.json" /version; do
    get "$path"
    expect 200
    size=$(stat -c %s answer) type=$(header content-type) etag=$(header etag)
    http HEAD "$path"
    expect 200
    [ "$(header content-length)" = "$size" ]
    [ "$(header content-type)" = "$type" ]
    [ "$(header etag)" = "$etag" ]
  done
}

@test "a method that a path does not have is refused with those it has" {
  http PUT "$cube"
  problem 405
  [[ $(header allow) == *GET* && $(header allow) == *DELETE* && $(header allow) == *HEAD* ]]
  http DELETE /v1/models
  problem 405
  [[ $(header allow) == *POST* ]]
  http POST /healthz --data ''
  problem 405
  http BREW /healthz
  [[ $status == 405 || $status == 501 ]]
  problem "$status"
}

@test "a path that there is not" {
  for path in /nothing /v1 /v2/models "$cube/nothing" "$cube/surface.stl" //v1/models; do
    get "$path"
    problem 404
  done
}

@test "OPTIONS names the methods" {
  http OPTIONS "$cube"
  [[ $status == 20[04] ]]
  [[ $(header allow) == *GET* && $(header allow) == *DELETE* ]]
}

@test "a browser's pre-flight is answered" {
  http OPTIONS /v1/models --header 'Origin: https://example.com' --header 'Access-Control-Request-Method: POST' \
    --header 'Access-Control-Request-Headers: content-type'
  [[ $status == 20[04] ]]
  [ "$(header access-control-allow-origin)" = '*' ]
  [[ $(header access-control-allow-methods) == *POST* ]]
  [[ $(header access-control-allow-headers) == *[Cc]ontent-[Tt]ype* ]]
}

@test "answers are readable from other origins, errors too" {
  get "$cube" --header 'Origin: https://example.com'
  [ "$(header access-control-allow-origin)" = '*' ]
  get /nothing --header 'Origin: https://example.com'
  [ "$(header access-control-allow-origin)" = '*' ]
}

# ---- headers -------------------------------------------------------------------------------------

@test "every answer has a request id; a sane one is taken over" {
  get "$cube"
  [[ $(header x-request-id) =~ ^[A-Za-z0-9._-]{8,}$ ]]
  get "$cube" --header 'X-Request-Id: my-request_17'
  [ "$(header x-request-id)" = my-request_17 ]
  get /nothing --header 'X-Request-Id: my-request_18'
  [ "$(header x-request-id)" = my-request_18 ]
  problem 404
  get "$cube" --header "X-Request-Id: $(head -c 5000 /dev/zero | tr '\0' x)"
  [ "$(header x-request-id | wc -c)" -lt 300 ]
  get "$cube" --header 'X-Request-Id: <script>'
  [[ $(header x-request-id) != *script* ]]
}

@test "every answer says how long it took" {
  for path in "$cube" "$cube/surface.glb?level=3" /nothing; do
    get "$path"
    [[ $(header server-timing) == *dur=* ]]
  done
}

@test "problems are not cached as models are" {
  get "$cube/surface.glb?level=x"
  problem 400
  [[ $(header cache-control) != *immutable* ]]
}

@test "a type that cannot be given" {
  get "$cube" --header 'Accept: image/png'
  problem 406
}

@test "unknown parameters are refused everywhere, by name" {
  for path in "$cube" "$cube/source" /v1/models /version /healthz; do
    get "$path?colour=red"
    problem 400 colour
  done
  post '/v1/models?colour=red' "$samples/cube.obj"
  problem 400 colour
}

@test "limit of the list must be a sane number" {
  for limit in 0 -1 x 99999999999; do
    get "/v1/models?limit=$limit"
    problem 400 limit
  done
}

# ---- framing -------------------------------------------------------------------------------------

@test "a body with two lengths is refused, and the connection closed" {
  raw 'POST /v1/models HTTP/1.1\r\nHost: x\r\nContent-Length: 3\r\nContent-Length: 40\r\n\r\nabcGET /healthz HTTP/1.1\r\nHost: x\r\n\r\n'
  [ "$status" = 400 ]
  alone
}

@test "a body with a length and chunks is refused, and the connection closed" {
  raw 'POST /v1/models HTTP/1.1\r\nHost: x\r\nContent-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET /healthz HTTP/1.1\r\nHost: x\r\n\r\n'
  [ "$status" = 400 ]
  alone
}

@test "a length behind a space does not smuggle a request" {
  raw 'POST /v1/models HTTP/1.1\r\nHost: x\r\nContent-Length : 41\r\n\r\nGET /healthz HTTP/1.1\r\nHost: x\r\n\r\n'
  [ "$status" = 400 ]
  alone
}

@test "a head that a reader could take in two ways is refused once, and nothing behind it is run" {
  local post='POST /v1/models HTTP/1.1\r\nHost: x\r\n' get='GET /version HTTP/1.1\r\nHost: x\r\n' head
  for head in "${post}Content-Length:\r\n 41\r\n" "${post}Content-Length:\r\n\t41\r\n" \
    "${post}Transfer-Encoding:\r\n chunked\r\n" "${get}X-A: b\r\n c\r\n" "${get}Accept:\r\n */*\r\n" \
    "${post}Content-Length: 3,3\r\n" "${post}Content-Length: +3\r\n" "${post}Content-Length: -1\r\n" \
    "${post}Content-Length: 3 3\r\n" "${post}Content-Length:\r\n" \
    "${post}Content-Length: 18446744073709551616\r\n" "${post}Content-Length: 3\0\r\n" \
    "${get}X-A: a\0b\r\n" "${get}X-A\0: a\r\n" 'GET /vers\0ion HTTP/1.1\r\nHost: x\r\n' \
    'GET /version HTTP/1.1\0\r\nHost: x\r\n' 'GET /version HTTP/1.1\r\nHost: x\0y\r\n'; do
    raw "$head"'\r\nGET /healthz HTTP/1.1\r\nHost: x\r\n\r\n'
    [ "$status" = 400 ] || { echo "$head"; cat answer; return 1; }
    alone || { echo "$head"; cat answer; return 1; }
  done
}

@test "blanks around values count for nothing" {
  get "$cube"
  etag=$(header etag)
  raw "GET $cube HTTP/1.1\r\nHost: x\r\nIf-None-Match:   $etag \t \r\nConnection: close\r\n\r\n"
  [ "$status" = 304 ]
  raw "GET $cube/surface HTTP/1.1\r\nHost: x\r\nAccept: model/obj   \r\nConnection: close\r\n\r\n"
  [ "$status" = 200 ]
  grep -aq '^Content-Type: model/obj' answer
  needs_process
  start_daemon --api-keys secret
  raw 'GET /v1/models HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer secret \r\nConnection: close\r\n\r\n'
  [ "$status" = 200 ]
  stop_daemon
}

@test "an answer that nothing has changed keeps the connection" {
  get "$cube"
  etag=$(header etag)
  raw "GET $cube HTTP/1.1\r\nHost: x\r\nIf-None-Match: $etag\r\n\r\nGET /version HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
  [ "$status" = 304 ]
  [ "$(grep -ac '^HTTP/1.1 200' answer)" = 1 ]
}

@test "an unknown transfer coding is refused" {
  raw 'POST /v1/models HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: cow\r\n\r\n'
  [[ $status == 400 || $status == 501 ]]
  alone
}

@test "a request without Host, and one with two, are refused" {
  raw 'GET /healthz HTTP/1.1\r\n\r\n'
  [ "$status" = 400 ]
  raw 'GET /healthz HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n'
  [ "$status" = 400 ]
}

@test "a zero byte in a path does not cut it off" {
  raw 'GET /healthz%00/nothing HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n'
  [[ $status == 400 || $status == 404 ]]
}

@test "an unknown expectation is refused" {
  raw 'POST /v1/models HTTP/1.1\r\nHost: x\r\nContent-Length: 3\r\nExpect: the-unexpected\r\nConnection: close\r\n\r\nabc'
  [[ $status == 417 || $status == 400 ]]
}

@test "five thousand parameters are refused, and the daemon lives on" {
  raw "GET /v1/models?$(printf 'a&%.0s' $(seq 5000)) HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
  [[ $status == 400 || $status == 414 || $status == 431 ]]
  get /healthz
  expect 200
}

@test "headers without end are refused" {
  raw "GET /healthz HTTP/1.1\r\nHost: x\r\nX-Long: $(head -c 200000 /dev/zero | tr '\0' x)\r\n\r\n"
  [[ $status == 400 || $status == 431 || $status == 413 ]]
  get /healthz
  expect 200
}

@test "two requests on one connection" {
  raw 'GET /healthz HTTP/1.1\r\nHost: x\r\n\r\nGET /version HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n'
  [ "$(grep -ac '^HTTP/1.1 200' answer)" = 2 ]
}
