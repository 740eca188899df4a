# What the end to end tests share: a daemon of their own for each file, requests by curl, answers by gojq: it
# starts faster than jq, sorts members, and is false of no answer at all, of which jq 1.6 says that all holds.
#
# TESTED_BINARY       the daemon (build/tweend)
# TESTED_URL          a daemon that already runs: cases that need the process are skipped then
# TESTED_DATA         a bucket as s3://BUCKET, where each test has models of its own; else they are in a folder
# TESTED_GLB_DIR      keeps every GLB that the daemon answers, for the validator
# TESTED_TRAFFIC_DIR  keeps the request line, head and JSON body of every answer, for the comparison with openapi.json
# TESTED_SANITIZED    "address" or "thread"
#
# Cases with the tag `plain` say nothing under sanitizers: mostly about memory and speed.

bats_require_minimum_version 1.8.0

export -n TWEEND_INSTALL # of the scripts; the daemon warns of variables that are none of its settings

root=$(cd "${BASH_SOURCE[0]%/*}/../.." && pwd)
samples=$root/server/samples

# ---- the daemon ----------------------------------------------------------------------------------

# start_daemon [FLAG...]: on a free port, with the models of this test; sets $url, $daemon (process id), $data.
start_daemon() {
  if [[ -n ${TESTED_URL-} ]]; then
    export url=${TESTED_URL%/} daemon=""
    return
  fi
  local here=${BATS_TEST_TMPDIR-}
  [[ -n $here ]] || here=$BATS_FILE_TMPDIR
  data=$here/data
  [[ -z ${TESTED_DATA-} ]] || data=$TESTED_DATA/${here//[!A-Za-z0-9]/-}
  # shellcheck disable=SC2086 # the runner may have arguments
  launch ${TESTED_RUNNER-} "${TESTED_BINARY:-$root/build/tweend}" --listen 127.0.0.1:0 --data "$data" \
    --cache-dir "$here/cache" "$@"
}

# pause SECONDS: sleep, without a process. Nothing is ever written to the pipe.
exec {quiet}<> <(:)
pause() { read -rt "$1" -u "$quiet" || true; }

# launch COMMAND...: waits for the ready line.
launch() {
  local here=${BATS_TEST_TMPDIR-}
  [[ -n $here ]] || here=$BATS_FILE_TMPDIR
  ready=$here/ready log=$here/log
  : >"$ready"
  "$@" >"$ready" 2>>"$log" 3>&- &
  daemon=$!
  local tries line
  url=""
  for ((tries = 0; tries < 600; tries++)); do
    while IFS= read -r line; do
      [[ ! $line =~ ^tweend\ [^\ ]*\ listening\ on\ (http.*)$ ]] || url=${BASH_REMATCH[1]}
    done <"$ready"
    [[ -z $url ]] || break
    kill -0 "$daemon" 2>/dev/null || break
    pause 0.05
  done
  export url daemon data log
  [[ -n $url ]] || { echo "the daemon printed no ready line"; cat "$log"; return 1; }
}

# s3 METHOD KEY [CURL ARGUMENT...]: past the daemon. KEY is below the test's prefix.
s3() {
  curl --silent --show-error --fail --aws-sigv4 aws:amz:us-east-1:s3 --user "$AWS_ACCESS_KEY_ID:$AWS_SECRET_ACCESS_KEY" \
    --header 'x-amz-content-sha256: UNSIGNED-PAYLOAD' --request "$1" "${@:3}" "$TWEEND_S3_ENDPOINT/${data#s3://}/$2"
}

# stop_daemon: by SIGTERM; it must end with status 0, and the sanitizers must have had nothing to say.
stop_daemon() {
  [[ -z ${TESTED_URL-} && -n ${daemon-} ]] || return 0
  kill -TERM "$daemon" 2>/dev/null || true # it may have ended by itself
  local status=0
  wait "$daemon" || status=$?
  daemon=""
  [[ -z ${group-} ]] || rmdir "$group"
  group=""
  if ((status != 0)) || grep -qE 'ERROR: AddressSanitizer|LeakSanitizer|runtime error:|ThreadSanitizer' "$log"; then
    echo "the daemon ended with status $status:"
    tail -n 60 "$log"
    return 1
  fi
}

# limit_group CONTROLLER FILE=VALUE...: the daemons of this test run in a group of processes with that limit, whose file
# versions 1 and 2 of cgroups name differently. stop_daemon removes the group.
limit_group() {
  local parent limit file
  for parent in "/sys/fs/cgroup/$1" /sys/fs/cgroup; do
    group=$parent/tweend-test-$$
    if [[ ! -e $parent/cgroup.procs ]] || ! mkdir "$group" 2>/dev/null; then continue; fi
    for limit in "${@:2}"; do
      file=$group/${limit%%=*}
      if [[ ! -e $file ]] || ! echo "${limit#*=}" >"$file"; then continue; fi
      printf '#!/bin/sh\necho $$ >%s/cgroup.procs\nexec %s "$@"\n' "$group" "${TESTED_RUNNER-}" >in_group
      chmod +x in_group
      TESTED_RUNNER=$PWD/in_group
      return
    done
    rmdir "$group"
  done
  group=""
  skip "no group of processes with a limit of $1 can be made here"
}

# admin_url: of the listener for probes and metrics, as the log names it last.
admin_url() { sed -n 's/.*probes and metrics on \(http:[^" ]*\).*/\1/p' "$log" | tail -n 1; }

# free_port: one that nobody listens on.
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# A test that looks at the process, its flags or its folder.
needs_process() { [[ -z ${TESTED_URL-} ]] || skip "needs the daemon's process"; }

# ---- requests ------------------------------------------------------------------------------------

# Starting a program, or a subshell, takes longer than most answers: what every request does is done by builtins.

# http METHOD PATH [CURL ARGUMENT...]: leaves $status, the headers in the file headers, the body in the
# file answer. A network error is status 000.
http() {
  local method=$1 path=$2 how answer_size answer_type
  shift 2
  how=(--request "$method")
  [[ $method != HEAD ]] || how=(--head)
  : >headers
  : >answer
  curl --silent --show-error --max-time 120 --globoff --path-as-is "${how[@]}" --dump-header headers --output answer \
    --write-out '%{http_code} %{size_download} %{content_type}\n' "$@" "$url$path" >outcome || true
  read -r status answer_size answer_type <outcome
  keep_glb "$path"
  keep_traffic "$method" "$path"
}

keep_glb() {
  [[ -n ${TESTED_GLB_DIR-} && $status == 200 && $answer_type == model/gltf-binary && $1 != */source* ]] || return 0
  local file=${BATS_TEST_FILENAME##*/} magic
  IFS= LC_ALL=C read -r -N 4 magic <answer || true
  [[ $magic == glTF ]] && ((answer_size < 8000000)) || return 0
  [[ -d $TESTED_GLB_DIR ]] || mkdir -p "$TESTED_GLB_DIR"
  cp answer "$TESTED_GLB_DIR/${file%.bats}-$BATS_TEST_NUMBER-$BASHPID-$EPOCHREALTIME.glb"
}

keep_traffic() {
  [[ -n ${TESTED_TRAFFIC_DIR-} && $status != 000 ]] || return 0
  [[ -d $TESTED_TRAFFIC_DIR ]] || mkdir -p "$TESTED_TRAFFIC_DIR"
  local file=${BATS_TEST_FILENAME##*/} head body=
  IFS= read -r -d '' head <headers || true
  if [[ $answer_type == *json* ]] && ((answer_size < 8000000)); then
    get_header content-encoding
    [[ -n $REPLY ]] || IFS= read -r -d '' body <answer || true
  fi
  printf '%s %s\n%s%s' "$1" "$2" "$head" "$body" >"$TESTED_TRAFFIC_DIR/${file%.bats}-$BATS_TEST_NUMBER-$BASHPID-$EPOCHREALTIME"
}

get() { http GET "$@"; }

# post PATH FILE [CURL ARGUMENT...]: the media type is left to curl's default, so the bytes decide.
post() { http POST "$1" --data-binary "@$2" "${@:3}"; }

# upload FILE: stores a model and sets $id.
upload() {
  post /v1/models "$1"
  [[ $status == 201 || $status == 200 ]] || { show; return 1; }
  id=$(gojq -r .id answer)
}

show() {
  echo "status $status"
  cat headers
  head -c 2000 answer | tr -d '\0'
}

# expect STATUS
expect() { [[ $status == "$1" ]] || { echo "expected $1"; show; return 1; }; }

# get_header NAME: sets $REPLY to its value, the last one's where it is there again.
get_header() {
  local text
  REPLY=
  IFS= read -r -d '' text <headers || true
  shopt -s nocasematch
  [[ ! $'\n'$text =~ .*$'\n'"$1: "*([^$'\r']*)$'\r' ]] || REPLY=${BASH_REMATCH[1]}
  shopt -u nocasematch
}

# header NAME: prints that value.
header() { get_header "$1" && printf '%s\n' "$REPLY"; }

# holds JQ-EXPRESSION [FILE]: is it true of the JSON answer?
holds() {
  gojq --exit-status "$1" "${2:-answer}" >/dev/null || { echo "does not hold: $1"; gojq -c . "${2:-answer}" | head -c 3000; return 1; }
}

# value JQ-EXPRESSION
value() { gojq --raw-output "$1" answer; }

# problem STATUS [PATTERN]: a problem document of the contract's form, its detail matching.
problem() {
  local detail
  expect "$1"
  get_header content-type
  [[ $REPLY == application/problem+json* ]] || { show; return 1; }
  get_header x-request-id
  detail=$(gojq --raw-output --argjson status "$1" --arg request "$REPLY" '
    if (.type | startswith("urn:tweend:problem:")) and (.type | endswith(":internal")) == ($status == 500)
      and (.title | type) == "string" and (.detail | type) == "string" and .status == $status
      and $request != "" and (.instance | endswith($request))
    then .detail else error("no problem document") end' answer) || { show; return 1; }
  [[ -z ${2-} || $detail =~ $2 ]] || { echo "detail does not match $2"; show; return 1; }
}

# ---- bytes ---------------------------------------------------------------------------------------

# u32 NUMBER: four bytes, little-endian.
u32() {
  local n=$1 i
  for i in 0 8 16 24; do
    # shellcheck disable=SC2059 # the format is the byte
    printf "\\$(printf %03o $(((n >> i) & 255)))"
  done
}

# glb JSON [BIN-FILE]: a GLB on standard output. BIN_LENGTH lies on request.
glb() {
  local json=$1 bin=${2-} bin_size=0 size
  while ((${#json} % 4)); do json+=" "; done
  size=$((20 + ${#json}))
  if [[ -n $bin ]]; then
    bin_size=$(stat -c %s "$bin")
    size=$((size + 8 + bin_size))
  fi
  printf glTF
  u32 2
  u32 "$size"
  u32 ${#json}
  printf 'JSON%s' "$json"
  if [[ -n $bin ]]; then
    u32 "${BIN_LENGTH:-$bin_size}"
    printf 'BIN\0'
    cat "$bin"
  fi
}

# glb_json FILE: the JSON chunk.
glb_json() {
  local size
  size=$(od -An -tu4 -j12 -N4 "$1" | tr -d ' ')
  tail -c +21 "$1" | head -c "$size"
}

# A grid of N x N points in the plane as OBJ.
grid() {
  awk -v n="$1" 'BEGIN {
    for (y = 0; y < n; y++) for (x = 0; x < n; x++) print "v", x, y, 0
    for (y = 0; y < n - 1; y++) for (x = 1; x < n; x++) print "f", y*n+x, y*n+x+1, y*n+n+x+1, y*n+n+x
  }'
}
