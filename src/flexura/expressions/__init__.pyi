from flexura.expressions import dimension as dimension
from flexura.expressions.expression import Expression as Expression
from flexura.expressions.expression import parameter as parameter
