# https: what of TLS the daemon speaks.

# shellcheck disable=SC2154 # the helper sets them
load ../e2e/helper

setup_file() {
  needs_process
  cd "$BATS_FILE_TMPDIR" || return
  openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=DNS:localhost \
    -keyout rsa.key -out rsa.pem 2>openssl.log
  openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=localhost \
    -addext subjectAltName=DNS:localhost -keyout ec.key -out ec.pem 2>>openssl.log
}

setup() { cd "$BATS_TEST_TMPDIR" || return; }
teardown() { stop_daemon; }

# start_tls KIND: with the certificate of that kind; sets $place.
start_tls() {
  start_daemon --tls-cert "$BATS_FILE_TMPDIR/$1.pem" --tls-key "$BATS_FILE_TMPDIR/$1.key"
  place=${url#https://}
}

# Security level 0, or the client itself would refuse what is old.
client() { openssl s_client -connect "$place" "$@" </dev/null 2>&1; }

shakes_hands() {
  run client "$@"
  [[ $status == 0 && $output == *"Cipher is "[TE]* ]] || { echo "$output"; false; }
}

is_refused() {
  run client "$@"
  [[ $status != 0 && $output == *"Cipher is (NONE)"* ]] || { echo "$output"; false; }
}

@test "TLS 1.3 and TLS 1.2 with forward secrecy shake hands" {
  for kind in rsa ec; do
    start_tls "$kind"
    shakes_hands -tls1_3
    shakes_hands -tls1_2
    [[ $output == *"Cipher is ECDHE-"* ]]
    curl --silent --fail --cacert "$BATS_FILE_TMPDIR/$kind.pem" "https://localhost:${place##*:}/healthz"
    stop_daemon
  done
  start_tls rsa
  shakes_hands -tls1_2 -cipher ECDHE-RSA-AES128-GCM-SHA256
}

@test "what is older than TLS 1.2 is refused" {
  start_tls rsa
  is_refused -tls1_1 -cipher ALL:@SECLEVEL=0
  is_refused -tls1 -cipher ALL:@SECLEVEL=0
  shakes_hands -tls1_2 -cipher ALL:@SECLEVEL=0
}

@test "an exchange of keys without forward secrecy is refused" {
  start_tls rsa
  for cipher in AES128-GCM-SHA256 AES256-GCM-SHA384 AES128-SHA; do
    is_refused -tls1_2 -cipher "$cipher:@SECLEVEL=0"
  done
  shakes_hands -tls1_2 -cipher "AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256:@SECLEVEL=0"
  [[ $output == *"Cipher is ECDHE-RSA-AES128-GCM-SHA256"* ]]
}

@test "ciphers without authentication of their own are refused" {
  for kind in rsa ec; do
    start_tls "$kind"
    for cipher in ECDHE-RSA-AES128-SHA ECDHE-RSA-AES256-SHA ECDHE-RSA-AES128-SHA256 ECDHE-ECDSA-AES128-SHA \
      ECDHE-ECDSA-AES256-SHA384 DHE-RSA-AES128-SHA; do
      is_refused -tls1_2 -cipher "$cipher:@SECLEVEL=0"
    done
    for cipher in AES256-GCM-SHA384 CHACHA20-POLY1305; do
      shakes_hands -tls1_2 -cipher "ECDHE-RSA-$cipher:ECDHE-ECDSA-$cipher"
    done
    stop_daemon
  done
}

@test "plain HTTP at an https address gets no answer" {
  start_tls rsa
  run curl --silent --max-time 5 "http://$place/healthz"
  ((status != 0))
  run curl --silent --fail --insecure "https://$place/healthz"
  ((status == 0))
}
