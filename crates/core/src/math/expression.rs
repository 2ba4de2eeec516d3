//! Arithmetic expressions, as in `1.2 * x + max(rise, 0.1)`.

use crate::error::Problem;

/// The deepest nesting of parentheses, signs and powers.
const DEEPEST: usize = 50;
const HELP: &str = "write it as in \"=1.2 * x + 0.1\": numbers, names, + - * / ^, parentheses, abs, sqrt, min, max, \
                    and sin, cos and tan of degrees";

/// An expression that can be evaluated: its steps in the order of evaluation (reverse Polish
/// notation).
#[derive(Clone, Debug)]
pub struct Expression(Vec<Step>);

#[derive(Clone, Debug)]
enum Step {
    Number(f64),
    Name(String),
    /// A function of the last value.
    One(fn(f64) -> f64),
    /// A function of the last two values.
    Two(fn(f64, f64) -> f64),
}

impl Expression {
    /// Reads an expression. `^` binds more tightly than a sign before it, and to the right. A name
    /// consists of letters, digits and `_`, or of anything in braces. Errors: the text is no
    /// expression, or is nested too deeply.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let mut parser = Parser { rest: text.trim_start(), steps: Vec::new(), depth: 0 };
        parser.sum()?;
        match parser.rest.chars().next() {
            None => Ok(Self(parser.steps)),
            Some(c) => Err(Problem::new(format!("`{}` was not expected here", shown(c)), HELP)),
        }
    }

    /// Returns the names in the expression.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter_map(|step| match step {
            Step::Name(name) => Some(name.as_str()),
            _ => None,
        })
    }

    /// Returns the value of the expression, where `of` returns the values of names. It is not
    /// finite where the expression has no value.
    pub fn value(&self, of: impl Fn(&str) -> f64) -> f64 {
        let mut values: Vec<f64> = Vec::new();
        for step in &self.0 {
            let value = match step {
                Step::Number(number) => *number,
                Step::Name(name) => of(name),
                Step::One(function) => function(values.pop().unwrap_or(f64::NAN)),
                Step::Two(function) => {
                    let second = values.pop().unwrap_or(f64::NAN);
                    function(values.pop().unwrap_or(f64::NAN), second)
                }
            };
            values.push(value);
        }
        values.pop().unwrap_or(f64::NAN)
    }
}

/// Returns the character as it may be shown in a message.
fn shown(c: char) -> char {
    if c.is_control() { '?' } else { c }
}

struct Parser<'a> {
    /// The text that is still to be read, without leading blanks.
    rest: &'a str,
    steps: Vec<Step>,
    depth: usize,
}

impl<'a> Parser<'a> {
    /// Reads so many bytes, and the blanks after them. Returns the text read, without these blanks.
    fn skip(&mut self, bytes: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(bytes);
        self.rest = rest.trim_start();
        taken
    }

    /// Reads this character if it comes next, and returns whether it does.
    fn take(&mut self, c: char) -> bool {
        let is_next = self.rest.starts_with(c);
        if is_next {
            self.skip(c.len_utf8());
        }
        is_next
    }

    fn needs(&mut self, c: char) -> Result<(), Problem> {
        if self.take(c) { Ok(()) } else { Err(Problem::new(format!("a `{c}` is missing"), HELP)) }
    }

    fn sum(&mut self) -> Result<(), Problem> {
        self.product()?;
        loop {
            let step: fn(f64, f64) -> f64 = if self.take('+') {
                |a, b| a + b
            } else if self.take('-') {
                |a, b| a - b
            } else {
                return Ok(());
            };
            self.product()?;
            self.steps.push(Step::Two(step));
        }
    }

    fn product(&mut self) -> Result<(), Problem> {
        self.signed()?;
        loop {
            let step: fn(f64, f64) -> f64 = if self.take('*') {
                |a, b| a * b
            } else if self.take('/') {
                |a, b| a / b
            } else {
                return Ok(());
            };
            self.signed()?;
            self.steps.push(Step::Two(step));
        }
    }

    /// Reads a factor with its sign. All nesting goes through here.
    fn signed(&mut self) -> Result<(), Problem> {
        if self.depth == DEEPEST {
            return Err(Problem::new(format!("nested more than {DEEPEST} deep"), "simplify it"));
        }
        self.depth += 1;
        if self.take('-') {
            self.signed()?;
            self.steps.push(Step::One(|a| -a));
        } else if self.take('+') {
            self.signed()?;
        } else {
            self.atom()?;
            if self.take('^') {
                self.signed()?;
                self.steps.push(Step::Two(f64::powf));
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn atom(&mut self) -> Result<(), Problem> {
        if self.take('(') {
            self.sum()?;
            return self.needs(')');
        }
        if self.rest.starts_with('{') {
            let Some(end) = self.rest.find('}') else { return self.needs('}') };
            let name = self.skip(end + 1);
            self.steps.push(Step::Name(name[1..end].trim().to_string()));
            return Ok(());
        }
        let length =
            |of: &dyn Fn(char) -> bool| self.rest.find(|c: char| !of(c)).unwrap_or(self.rest.len());
        match self.rest.chars().next() {
            Some(c) if c.is_ascii_digit() || c == '.' => {
                let mut end = length(&|c| c.is_ascii_digit() || c == '.');
                // exponents, as in 1e3 and 1e-3
                if let Some(exponent) = self.rest[end..].strip_prefix(['e', 'E']) {
                    let digits = exponent.trim_start_matches(['+', '-']);
                    let sign = exponent.len() - digits.len();
                    let digits = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
                    if sign <= 1 && digits > 0 {
                        end += 1 + sign + digits;
                    }
                }
                let text = self.skip(end);
                let number = text.parse();
                let number =
                    number.map_err(|_| Problem::new(format!("`{text}` is no number"), HELP))?;
                self.steps.push(Step::Number(number));
                Ok(())
            }
            Some(c) if c.is_alphabetic() || c == '_' => {
                let end = length(&|c| c.is_alphanumeric() || c == '_');
                let name = self.skip(end);
                if self.take('(') {
                    return self.call(name);
                }
                self.steps.push(Step::Name(name.to_string()));
                Ok(())
            }
            Some(c) => Err(Problem::new(format!("`{}` was not expected here", shown(c)), HELP)),
            None => Err(Problem::new("it ends too early", HELP)),
        }
    }

    /// Reads the arguments of a function.
    fn call(&mut self, name: &str) -> Result<(), Problem> {
        let two: Option<fn(f64, f64) -> f64> = match name {
            "min" => Some(f64::min),
            "max" => Some(f64::max),
            _ => None,
        };
        let one: fn(f64) -> f64 = match name {
            "abs" => f64::abs,
            "sqrt" => f64::sqrt,
            "sin" => |a| a.to_radians().sin(),
            "cos" => |a| a.to_radians().cos(),
            "tan" => |a| a.to_radians().tan(),
            _ if two.is_some() => |a| a,
            _ => return Err(Problem::new(format!("there is no function `{name}`"), HELP)),
        };
        self.sum()?;
        match two {
            Some(two) => {
                self.needs(',')?;
                self.sum()?;
                self.steps.push(Step::Two(two));
            }
            None => self.steps.push(Step::One(one)),
        }
        self.needs(')')
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn value(text: &str) -> f64 {
        let of = |name: &str| match name {
            "x" => 3.0,
            "row 1/power" => 10.0,
            _ => f64::NAN,
        };
        Expression::parse(text).unwrap_or_else(|e| panic!("{text}: {}", e.at("here"))).value(of)
    }

    #[test]
    fn values_of_expressions() {
        for (text, expected) in [
            ("1.2 * x", 1.2 * 3.0),
            ("1 + 2 * 3 - 4 / 2", 5.0),
            ("10 - 4 - 3", 3.0),
            ("24 / 4 / 2", 3.0),
            ("2 ^ 3 ^ 2", 512.0),
            ("-2 ^ 2", -4.0),
            ("2 ^ -1", 0.5),
            ("(1 + 2) * -(3)", -9.0),
            (" { row 1/power } / 4", 2.5),
            ("y + 1", f64::NAN),
            ("min(x, 2) + max(x, 2) + abs(-1)", 6.0),
            ("sqrt(16) + 1e2 + 1.5E-1 + .5", 104.65),
            ("2*sin(30) + cos(60)", 1.5),
            ("1 / 0", f64::INFINITY),
        ] {
            let found = value(text);
            let is_same = (found - expected).abs() < 1e-12 || found == expected;
            assert!(is_same || found.is_nan() && expected.is_nan(), "{text}: {found}");
        }
        let names = Expression::parse("a + {b c} * a").expect("sound");
        assert_eq!(names.names().collect::<Vec<_>>(), ["a", "b c", "a"]);
    }

    #[test]
    fn what_is_no_expression_is_refused() {
        let deep = "(".repeat(DEEPEST);
        for (text, words) in [
            ("", "it ends too early"),
            ("1 +", "it ends too early"),
            ("1 2", "`2` was not expected here"),
            ("* 2", "`*` was not expected here"),
            ("(1", "a `)` is missing"),
            ("{a", "a `}` is missing"),
            ("1.2.3", "`1.2.3` is no number"),
            ("lamp(2)", "there is no function `lamp`"),
            ("max(2)", "a `,` is missing"),
            (&deep, "nested more than 50 deep"),
        ] {
            let error = Expression::parse(text).expect_err(text).at("here").to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text gives a number or an error message.
        #[test]
        fn no_text_panics(text in "[-+*/^(){},.0-9exa_ sinmü]{0,60}") {
            if let Ok(expression) = Expression::parse(&text) {
                expression.value(|_| 1.5);
            }
        }
    }
}
