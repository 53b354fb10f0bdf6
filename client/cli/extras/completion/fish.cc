#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/extras/completion/shell_scripts.h"
#include "client/cli/extras/completion/table.h"

namespace locus::cli {
namespace {

// Shell functions that read the completion table (table.h). NAME is replaced by the program's name.
constexpr char kFunctions[] = R"shell(
# Prints the kind of value of the option $option of the command $place; nothing if it is a flag or unknown.
function __NAME_value --argument-names place option
    for line in (__NAME_table $place)
        set -l fields (string split \t -- $line)
        if test "$fields[1] $fields[2]" = "option $option" -a "$fields[3]" != -
            echo $fields[3]
        end
    end
end

# Prints the words of the kind $kind in the table of the command $place, each with its description.
function __NAME_offer --argument-names place kind
    for line in (__NAME_table $place)
        set -l fields (string split \t -- $line)
        if test "$fields[1]" = $kind
            printf '%s\t%s\n' $fields[2] $fields[4]
        end
    end
end

# Prints the scenes of the server at $address, using $program; nothing if the server does not answer within a second.
function __NAME_scenes --argument-names program address
    set -l where
    test -n "$address"; and set where --address=$address
    $program $where --timeout 1 --output ndjson scene list 2>/dev/null </dev/null |
        string replace -rf '^\{.*"name":"([a-z0-9._-]*)".*' '$1'
end

# Prints the candidates for a value of the kind $wanted, each prefixed with $before, the part of the word before the
# value. $typed is the part of the value typed so far.
function __NAME_offer_values --argument-names wanted before typed program address
    switch "$wanted"
        case 'choice *'
            printf '%s\n' $before(string split ' ' -- $wanted)[2..-1]
        case 'list *'
            set before $before(string replace -r '[^,]*$' '' -- $typed)
            printf '%s\n' $before(string split ' ' -- $wanted)[2..-1]
        case scene
            printf '%s\n' $before(__NAME_scenes $program $address)
        case file
            __fish_complete_path $before$typed
    end
end

# Parses the words before the cursor. Prints the command, the number of positional arguments, the kind of value of the
# option before the cursor (or an empty line), and the server's address.
function __NAME_walk
    set -l place $argv[1]
    set -e argv[1]
    set -l position 0
    set -l address
    while set -q argv[1]
        if string match -q -- '--*=*' $argv[1]
            string match -q -- '--address=*' $argv[1]; and set address (string split -m 1 = -- $argv[1])[2]
        else if string match -q -- '-?*' $argv[1]
            set -l wanted (__NAME_value $place $argv[1])
            if test -n "$wanted" -a (count $argv) -eq 1
                printf '%s\n' $place $position $wanted "$address"
                return
            end
            test "$wanted" = address; and set address $argv[2]
            test -n "$wanted"; and set -e argv[1]
        else if __NAME_offer $place command | string match -q -- $argv[1]\t'*'
            set place "$place $argv[1]"
            set position 0
        else
            set position (math $position + 1)
        end
        set -e argv[1]
    end
    printf '%s\n' $place $position '' "$address"
end

function __NAME_complete
    set -l words (commandline -opc)
    set -l typed (commandline -ct)
    set -l at (__NAME_walk NAME $words[2..-1])
    if test -n "$at[3]"
        __NAME_offer_values $at[3] '' "$typed" $words[1] $at[4]
    else if string match -q -- '--*=*' $typed
        set -l parts (string split -m 1 = -- $typed)
        __NAME_offer_values (__NAME_value $at[1] $parts[1]) $parts[1]= "$parts[2]" $words[1] $at[4]
    else if string match -q -- '-*' $typed
        __NAME_offer $at[1] option
    else
        __NAME_offer $at[1] command
        set -l takes
        for line in (__NAME_table $at[1])
            set -l fields (string split \t -- $line)
            test "$fields[1]" = positional; and set -a takes $fields[3]
        end
        test $at[2] -lt (count $takes); and __NAME_offer_values $takes[(math $at[2] + 1)] '' "$typed" $words[1] $at[4]
    end
end

complete -c NAME -e
complete -c NAME -f -a '(__NAME_complete)'
)shell";

std::string fish_quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"'", "\\'"}}), "'");
}

std::string fish_table_function(const CommandWords& program) {
  std::string script = absl::StrCat("# A line for each candidate: kind, word, kind of value, description.\nfunction __",
                                    program.path, "_table\n    switch $argv[1]\n");
  for (const TableEntry& entry : completion_table(program)) {
    absl::StrAppend(&script, "        case ", fish_quoted(entry.path), "\n            printf '%s\\n'");
    for (const std::string& line : entry.lines) absl::StrAppend(&script, " \\\n                ", fish_quoted(line));
    absl::StrAppend(&script, "\n");
  }
  absl::StrAppend(&script, "    end\nend\n");
  return script;
}

}  // namespace

std::string fish_script(const CommandWords& program) {
  return absl::StrCat("# Completion of ", program.path, " for fish, written by `", program.path,
                      " completion fish`.\n\n", fish_table_function(program),
                      absl::StrReplaceAll(kFunctions, {{"NAME", program.path}}));
}

}  // namespace locus::cli
