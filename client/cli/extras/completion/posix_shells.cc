#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/extras/completion/shell_scripts.h"
#include "client/cli/extras/completion/table.h"

namespace locus::cli {
namespace {

// Shell functions for bash and zsh that read the completion table (table.h). NAME is replaced by the program's name.
constexpr char kReadersOfTheTable[] = R"shell(
# Prints the kind of value of the option $2 of the command $1; nothing if it is a flag or unknown.
_NAME_value() {
  local kind word value text
  while IFS=$'\t' read -r kind word value text; do
    if [ "$kind $word" = "option $2" ] && [ "$value" != - ]; then printf '%s' "$value"; fi
  done < <(_NAME_table "$1")
}

# Prints the kind of value of the positional argument with index $2, from 0, of the command $1.
_NAME_positional() {
  local kind word value text number=0
  while IFS=$'\t' read -r kind word value text; do
    if [ "$kind" = positional ]; then
      if [ "$number" -eq "$2" ]; then printf '%s' "$value"; fi
      number=$((number + 1))
    fi
  done < <(_NAME_table "$1")
}

# Parses the words before the cursor. Sets place (the command), position (the number of positional arguments), wanted
# (the kind of value of the option before the cursor, or empty) and address (the server's).
_NAME_walk() {
  place=NAME position=0 wanted= address=
  while [ $# -gt 0 ]; do
    case $1 in
      --address=*) address=${1#*=} ;;
      --*=*) ;;
      -?*)
        wanted=$(_NAME_value "$place" "$1")
        if [ -n "$wanted" ]; then
          if [ $# -eq 1 ]; then return; fi
          if [ "$wanted" = address ]; then address=$2; fi
          wanted=
          shift
        fi
        ;;
      *)
        if [[ $'\n'$(_NAME_table "$place") == *$'\n'command$'\t'"$1"$'\t'* ]]; then
          place="$place $1" position=0
        else
          position=$((position + 1))
        fi
        ;;
    esac
    shift
  done
}

# Prints the scenes of the server, using the program $1; nothing if the server does not answer within a second.
_NAME_scenes() {
  "$1" ${address:+"--address=$address"} --timeout 1 --output ndjson scene list 2> /dev/null < /dev/null |
    sed -n 's/^{.*"name":"\([a-z0-9._-]*\)".*/\1/p'
}
)shell";

constexpr char kBash[] = R"shell(
# Sets typed to the words up to the cursor, split at blanks only; bash itself also splits them at = and :.
_NAME_typed_words() {
  local rest=${COMP_LINE:0:COMP_POINT} i
  typed=()
  for ((i = 0; i <= COMP_CWORD; i++)); do
    if [[ $i -eq 0 || $rest == [[:space:]]* ]]; then
      rest=${rest#"${rest%%[![:space:]]*}"}
      typed+=("")
    fi
    if ((i == COMP_CWORD)); then typed[-1]+=$rest; else typed[-1]+=${COMP_WORDS[i]}; fi
    rest=${rest#"${COMP_WORDS[i]}"}
  done
}

# Prints the words of the kind $2 in the table of the command $1.
_NAME_words() {
  local kind word value text
  while IFS=$'\t' read -r kind word value text; do
    if [[ $kind == "$2" ]]; then printf '%s\n' "$word"; fi
  done < <(_NAME_table "$1")
}

_NAME() {
  local typed place position wanted address current
  _NAME_typed_words
  current=${typed[-1]}
  _NAME_walk "${typed[@]:1:${#typed[@]}-2}"
  COMPREPLY=()
  if [[ -z $wanted && $current == --*=* ]]; then
    wanted=$(_NAME_value "$place" "${current%%=*}")
    current=${current#*=}
  elif [[ -z $wanted && $current == -* ]]; then
    wanted="choice $(_NAME_words "$place" option)"
  elif [[ -z $wanted ]]; then
    wanted="choice $(_NAME_words "$place" command)"
    if [[ $wanted == "choice " ]]; then wanted=$(_NAME_positional "$place" "$position"); fi
  fi
  case $wanted in
    'choice '*) mapfile -t COMPREPLY < <(compgen -W "${wanted#choice }" -- "$current") ;;
    'list '*)
      mapfile -t COMPREPLY < <(compgen -P "${current%"${current##*,}"}" -W "${wanted#list }" -- "${current##*,}")
      compopt -o nospace 2> /dev/null
      ;;
    scene) mapfile -t COMPREPLY < <(compgen -W "$(_NAME_scenes "${typed[0]}")" -- "$current") ;;
    file)
      mapfile -t COMPREPLY < <(compgen -f -- "$current")
      compopt -o filenames 2> /dev/null
      ;;
  esac
}

complete -F _NAME NAME
)shell";

constexpr char kZsh[] = R"shell(
# Offers the words of the kind $2 in the table of the command $1, each with its description.
_NAME_offer() {
  local kind word value text
  local -a found
  while IFS=$'\t' read -r kind word value text; do
    if [[ $kind == $2 ]]; then found+=("${word//:/\\:}:$text"); fi
  done < <(_NAME_table "$1")
  if [[ $2 == option ]]; then _describe -o option found; else _describe $2 found; fi
}

_NAME() {
  local place position wanted address
  _NAME_walk "${(@)words[2,CURRENT-1]}"
  if [[ -z $wanted && $PREFIX == --*=* ]]; then
    wanted=$(_NAME_value "$place" "${PREFIX%%=*}")
    compset -P '*='
  elif [[ -z $wanted && $PREFIX == -* ]]; then
    _NAME_offer "$place" option
    return
  elif [[ -z $wanted ]]; then
    if [[ $(_NAME_table "$place") == command$'\t'* ]]; then
      _NAME_offer "$place" command
      return
    fi
    wanted=$(_NAME_positional "$place" "$position")
  fi
  case $wanted in
    'choice '*) compadd -- ${=wanted#choice } ;;
    'list '*) compset -P '*,'; compadd -S '' -- ${=wanted#list } ;;
    scene) compadd -- ${(f)"$(_NAME_scenes "$words[1]")"} ;;
    file) _files ;;
  esac
}

if [[ ${funcstack[1]} == _NAME ]]; then _NAME "$@"; else compdef _NAME NAME; fi
)shell";

std::string posix_quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "'\\''"}}), "'");
}

std::string posix_table_function(const CommandWords& program) {
  std::string script = absl::StrCat("# A line for each candidate: kind, word, kind of value, description.\n_",
                                    program.path, "_table() {\n  case $1 in\n");
  for (const TableEntry& entry : completion_table(program)) {
    absl::StrAppend(&script, "    ", posix_quoted(entry.path), ") printf '%s\\n'");
    for (const std::string& line : entry.lines) absl::StrAppend(&script, " \\\n      ", posix_quoted(line));
    absl::StrAppend(&script, " ;;\n");
  }
  absl::StrAppend(&script, "  esac\n}\n");
  return script;
}

std::string script_of(const CommandWords& program, const std::string& shell, const char* functions) {
  return absl::StrCat("# Completion of ", program.path, " for ", shell, ", written by `", program.path, " completion ",
                      shell, "`.\n\n", posix_table_function(program),
                      absl::StrReplaceAll(absl::StrCat(kReadersOfTheTable, functions), {{"NAME", program.path}}));
}

}  // namespace

std::string bash_script(const CommandWords& program) { return script_of(program, "bash", kBash); }

std::string zsh_script(const CommandWords& program) {
  return absl::StrCat("#compdef ", program.path, "\n", script_of(program, "zsh", kZsh));
}

}  // namespace locus::cli
