// The grammar of MAUVE for tree-sitter. Its rules follow `syntax/mauve.ungram` and have the same names in snake case;
// `tests/tree_sitter.rs` compares the trees with those of MAUVE's own parser.
//
// Every keyword is contextual: a `name` or `name_ref` may be any word. So these rules list all keywords, each as an
// `identifier`, and a query that highlights `"state"` does not match a name `state`.

/// Keywords that are values. In an expression they are literals, never names.
const LITERALS = ['true', 'false', 'new_data', 'old_data', 'no_data', 'success', 'not_ready', 'failure'];

/// All other words that the rules below use.
const KEYWORDS = [
  'activity', 'architecture', 'cleanup', 'codel', 'component', 'configure', 'connection', 'constant', 'core',
  'deployment', 'else', 'entry', 'exit', 'extends', 'handle', 'handler', 'if', 'import', 'in', 'include', 'initial',
  'inout', 'input', 'instance', 'library', 'operation', 'out', 'output', 'port', 'property', 'provide', 'require',
  'return', 'run', 'shell', 'start', 'state', 'statemachine', 'stop', 'then', 'to', 'transition', 'update', 'use',
  'var',
];

/// The precedence of binary operators, from `strength` in `syntax/src/grammar/expression.rs`.
const PRECEDENCE = { or: 1, and: 2, equality: 3, sum: 5, product: 6 };

/// `one, two, …`, at least one.
const separated = (rule) => seq(rule, repeat(seq(',', rule)));

/// `{ item … }`. Items may be separated by `;`.
const list = (rule) => seq('{', repeat(choice(rule, ';')), '}');

/// A rule that also begins with a keyword which may be a name: the keyword takes precedence.
const keyword_first = (rule) => prec(1, rule);

export default grammar({
  name: 'mauve',

  word: ($) => $.identifier,

  // Exactly the white space of the lexer: other white space is an error.
  extras: ($) => [/[ \t\f\r\n]/, $.line_comment, $.block_comment],

  inline: ($) => [$._word_ref],

  // `else` after a block begins a branch before `{` or `if`, and a statement before `=` or `(`.
  conflicts: ($) => [[$.if_statement]],

  rules: {
    // Includes come before all declarations.
    source_file: ($) => seq(repeat(choice($.include, ';')), optional(seq($._item, repeat(choice($._item, ';'))))),

    _item: ($) => choice($.library, $._declaration),
    _declaration: ($) =>
      choice($.use, $.codel, $.shell, $.core, $.component, $.architecture, $.deployment),

    name: ($) => choice($.identifier, ...[...KEYWORDS, ...LITERALS].map((word) => alias(word, $.identifier))),
    name_ref: ($) => choice($.identifier, ...KEYWORDS.map((word) => alias(word, $.identifier))),
    _literal_ref: ($) => choice(...LITERALS.map((word) => alias(word, $.identifier))),
    // A `name_ref` outside expressions.
    _word_ref: ($) => choice($.name_ref, alias($._literal_ref, $.name_ref)),
    type: ($) => seq(repeat(seq(field('package', $._word_ref), choice('.', '::'))), field('name', $._word_ref)),

    include: ($) => seq('include', $.string),
    library: ($) => seq('library', $.name, list($._declaration)),
    use: ($) => seq('use', $._word_ref),

    codel: ($) => seq('codel', $.name, $.param_list, ':', $.type),
    param_list: ($) => seq('(', optional(separated($.param)), ')'),
    param: ($) => seq(optional(choice('in', 'out', 'inout')), $.name, ':', $.type),

    shell: ($) => seq('shell', $.name, optional($.extends), list($._shell_item)),
    extends: ($) => seq('extends', separated($.type)),
    _shell_item: ($) => choice($.property, $.port, $.operation_declaration),
    property: ($) =>
      seq(choice('constant', 'property'), $.name, ':', $.type, optional($.interval), optional($.initializer)),
    interval: ($) => seq('[', field('low', $._expr), ';', field('high', $._expr), ']'),
    initializer: ($) => seq('=', $._expr),
    port: ($) => seq(choice('input', 'output'), 'port', $.name, ':', $.type),
    operation_declaration: ($) => seq(choice('require', 'provide'), $.name, $.param_list, ':', $.type),

    core: ($) => seq('core', $.name, '(', $.type, ')', optional(':'), list($._core_item)),
    _core_item: ($) => choice($.var, $.handler, $.operation_definition, $.hook, $.state_machine),
    var: ($) => keyword_first(seq('var', $.name, ':', $.type, optional($.initializer))),
    handler: ($) => seq('handler', $.name, ':', $.type),
    operation_definition: ($) => seq('provide', $.name, $.param_list, optional($.result_type), '=', $.block),
    result_type: ($) => seq(':', $.type),
    hook: ($) => seq(choice('configure', 'start', 'update', 'stop', 'cleanup'), '=', $.block),

    component: ($) =>
      seq('component', $.name, '(', field('shell', $.type), ',', field('core', $.type), ')'),

    state_machine: ($) => seq('statemachine', list($._state_machine_item)),
    _state_machine_item: ($) => choice($.var, $.state),
    state: ($) => seq(optional('initial'), 'state', $.name, list($._state_item)),
    _state_item: ($) => choice($.method, $.transition),
    method: ($) => seq(choice('entry', 'run', 'handle', 'exit'), '=', $.block),
    transition: ($) => seq('transition', $.name, optional($.guard), 'to', $._word_ref, optional($.block)),
    guard: ($) => seq('if', $._expr),

    architecture: ($) => seq('architecture', $.name, list($._architecture_item)),
    _architecture_item: ($) =>
      choice($.import, $.instance, $.connection, $.operation_connection, $.setting),
    import: ($) => seq('import', $.type),
    instance: ($) => seq('instance', $.name, ':', $.type),
    connection: ($) =>
      seq('connection', field('source', $.endpoint), '->', optional($.buffer), field('target', $.endpoint)),
    buffer: ($) => seq('[', $.int_number, ']'),
    operation_connection: ($) =>
      seq('operation', field('source', $.endpoint), '->', field('target', $.endpoint)),
    setting: ($) => seq(choice('property', 'constant'), $.endpoint, '=', $._expr),
    endpoint: ($) => seq(field('instance', $._word_ref), '.', field('feature', $._word_ref)),

    deployment: ($) => seq('deployment', $.name, list($._deployment_item)),
    // The parser accepts a target anywhere; the checks report a second one.
    _deployment_item: ($) => choice($.target, $.activity, $.setting),
    target: ($) => seq('architecture', $.type),
    activity: ($) => seq('activity', $._word_ref, list($.field)),
    field: ($) =>
      choice(
        seq($._word_ref, '=', choice($._expr, $.value_list)),
        // Only a rate has a unit.
        seq(alias($._rate, $.name_ref), '=', choice(seq($._expr, optional(alias('Hz', $.identifier))), $.value_list)),
      ),
    _rate: ($) => alias('rate', $.identifier),
    // The word is `any` or `all`: the checks report others.
    value_list: ($) => seq(optional($.identifier), '[', optional(separated($._expr)), ']'),

    block: ($) => list($._statement),
    _statement: ($) =>
      choice(
        $.var,
        $.if_statement,
        $.block_statement,
        $.return_statement,
        $.assign_statement,
        $.expr_statement,
      ),
    if_statement: ($) =>
      keyword_first(seq('if', field('condition', $._expr), 'then', field('then_block', $.block), optional($.else))),
    else: ($) => seq('else', choice($.block, $.if_statement)),
    block_statement: ($) => $.block,
    return_statement: ($) => keyword_first(seq('return', optional($._expr), ';')),
    assign_statement: ($) => seq($._word_ref, '=', $._expr, ';'),
    expr_statement: ($) => seq($._expr, ';'),

    // Comparisons do not chain: an operand of `<` has no `<`, except in parentheses.
    _expr: ($) => choice($.binary_expr, alias($._comparison, $.binary_expr), $._sum),
    binary_expr: ($) =>
      choice(
        binary($._expr, '||', PRECEDENCE.or),
        binary($._expr, '&&', PRECEDENCE.and),
        binary($._expr, choice('==', '!='), PRECEDENCE.equality),
      ),
    _comparison: ($) => seq(field('lhs', $._sum), choice('<', '<=', '>', '>='), field('rhs', $._sum)),
    _sum: ($) => choice(alias($._arithmetic, $.binary_expr), $._operand),
    _arithmetic: ($) =>
      choice(
        binary($._sum, choice('+', '-'), PRECEDENCE.sum),
        binary($._sum, choice('*', '/', '%'), PRECEDENCE.product),
      ),
    _operand: ($) => choice($.literal, $.name_expr, $.call_expr, $.paren_expr, $.unary_expr),
    literal: ($) => choice($.int_number, $.float_number, $.string, ...LITERALS),
    name_expr: ($) => $.name_ref,
    // A `(` after a name begins its arguments, also where the next statement could begin.
    call_expr: ($) => prec(1, seq($.name_ref, $.argument_list)),
    argument_list: ($) => seq('(', optional(separated($._expr)), ')'),
    paren_expr: ($) => seq('(', $._expr, ')'),
    unary_expr: ($) => seq(choice('!', '-'), $._operand),

    identifier: () => /[A-Za-z_][A-Za-z0-9_]*/,
    int_number: () => /[0-9]+|0[xX][0-9a-fA-F]+/,
    float_number: () => /[0-9]+\.[0-9]+([eE][+-]?[0-9]+)?|[0-9]+[eE][+-]?[0-9]+/,
    string: () => /"([^"\\\r\n]|\\["\\nt])*"/,
    line_comment: () => /\/\/[^\r\n]*/,
    block_comment: () => /\/\*[^*]*\*+([^/*][^*]*\*+)*\//,
  },
});

/// `lhs operator rhs`, left-associative.
function binary(operand, operator, precedence) {
  return prec.left(precedence, seq(field('lhs', operand), operator, field('rhs', operand)));
}
