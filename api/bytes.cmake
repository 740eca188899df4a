# Files as C code, for scripts that embed them.

# A string literal compiles ten times as fast as a list of numbers, but ISO C promises only 4,095 characters.
set(BYTES_HEAD "#pragma GCC diagnostic ignored \"-Woverlength-strings\"\n")

# bytes_of(VARIABLE FILE): the bytes of a file as a string literal, which ends with a 0 that is not of the file.
function(bytes_of variable file)
  execute_process(COMMAND od -An -v -to1 "${file}" COMMAND sed "s/ /\\\\/g; s/.*/\"&\"/"
    OUTPUT_VARIABLE literal COMMAND_ERROR_IS_FATAL ANY)
  set(${variable} "${literal}" PARENT_SCOPE)
endfunction()
